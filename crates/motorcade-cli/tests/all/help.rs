//! Help, version, completions.

use std::path::Path;

use crate::common::answer;

#[test]
fn every_command_shows_examples() {
    let commands = [
        "",
        "run",
        "batch",
        "inspect",
        "draw",
        "export",
        "tables",
        "evaluate",
        "ablate",
        "ablate odometry",
        "ablate graph",
        "ablate paper",
        "ablate scale",
        "ablate vehicles",
        "shape",
        "shape convert",
        "graph",
        "graph optimise",
        "graph info",
        "graph compare",
        "map",
        "map info",
        "map export",
        "map merge",
        "completions",
    ];
    for command in commands {
        let help = answer(Path::new("."), &format!("{command} --help"));
        help.expect(0, &[]);
        assert!(help.stdout.contains("Example"), "{command}:\n{}", help.stdout);
        assert!(help.stdout.contains(&format!("motorcade {command}")), "{command}:\n{}", help.stdout);
    }
}

#[test]
fn help_lists_every_command_there_is() {
    // A command added later must join the list above.
    let help = answer(Path::new("."), "--help").stdout;
    let listed = help.split("Commands:").nth(1).unwrap().split("\n\n").next().unwrap();
    let names: Vec<&str> = listed
        .lines()
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    for name in &names {
        let page = answer(Path::new("."), &format!("{name} --help"));
        assert!(*name == "help" || page.stdout.contains("Example"), "{name}:\n{}", page.stdout);
    }
    assert!(names.contains(&"run") && names.contains(&"graph"), "{names:?}");
}

#[test]
fn version_and_completions() {
    let version = answer(Path::new("."), "--version");
    assert_eq!(version.expect(0, &[]).stdout.trim(), format!("motorcade {}", env!("CARGO_PKG_VERSION")));
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = answer(Path::new("."), &format!("completions {shell}"));
        assert!(script.expect(0, &[]).stdout.contains("evaluate"), "{shell}");
    }
    answer(Path::new("."), "completions tcsh").expect(1, &["tcsh"]);
}

#[test]
fn no_command_and_a_wrong_one_are_usage() {
    answer(Path::new("."), "").expect(1, &["Usage"]);
    answer(Path::new("."), "rum").expect(1, &["rum"]);
}
