//! Places of results: links, streams, directories that are there already, two runs into one.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::os::unix::fs::{FileTypeExt, symlink};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::places::{Fifo, Link};
use crate::common::{Answer, answer, drive, json, no_leftovers, nothing_written, program, run};

const USUAL: &str = "run frames --calibration camera.toml --height 1.5 --threads 1 --progress none --out";

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A shell in a folder, with the program as `$PROGRAM`.
fn shell(folder: &Path, script: &str) -> Answer {
    let mut command = Command::new("sh");
    command.args(["-c", script]).current_dir(folder);
    command.env("PROGRAM", env!("CARGO_BIN_EXE_motorcade")).env("MOTORCADE_MODELS", "none");
    command.output().unwrap().into()
}

#[test]
fn files_are_written_through_links_and_into_streams() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("in.g2o"), "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 2 0 0 1 0 0 1 0 1\n")
        .unwrap();
    let links = ["graph", "report", "prior"].map(|name| Link::new(at(name)));
    answer(folder.path(), "graph optimise in.g2o --out graph --json report").expect(0, &[]);
    answer(folder.path(), "shape export --out prior").expect(0, &[]);
    for (link, start) in links.iter().zip(["VERTEX_SE2", "{", "{"]) {
        assert!(link.text().starts_with(start), "{start}");
    }
    let fifo = Fifo::new(at("fifo"));
    answer(folder.path(), "graph optimise in.g2o --out out.g2o --json fifo").expect(0, &[]);
    let report: serde_json::Value = serde_json::from_str(&fifo.text()).unwrap();
    assert_eq!(report["termination"], "converged");
    let fifo = Fifo::new(at("stream"));
    answer(folder.path(), "graph optimise in.g2o --out stream").expect(0, &[]);
    assert_eq!(fifo.text(), fs::read_to_string(at("out.g2o")).unwrap());
    let script = "$PROGRAM shape export --out /dev/stdout | head -c 1; $PROGRAM shape export --out /dev/null";
    assert!(shell(folder.path(), script).expect(0, &[]).stdout.starts_with('{'));
    assert!(fs::symlink_metadata("/dev/null").unwrap().file_type().is_char_device());
    // Nobody reads: an error at once, not a program that waits.
    answer(folder.path(), "graph optimise in.g2o --out out.g2o --json fifo")
        .expect(5, &["fifo", "no process reads"]);
    fs::create_dir(at("folder")).unwrap();
    answer(folder.path(), "shape export --out folder").expect(5, &["folder", "directory"]);
    no_leftovers(folder.path());
}

/// An output that would replace a calibration, labels or a picture is refused at once; an earlier result of the same kind is replaced.
#[test]
fn outputs_replace_no_inputs_and_not_each_other() {
    let folder = drive(12);
    let at = |name: &str| folder.path().join(name);
    let before = fs::read(at("camera.toml")).unwrap();
    let refused = ["camera.toml", "is already there", "a map"];
    run(folder.path(), "--save-map camera.toml").expect(1, &refused);
    run(folder.path(), "--save-map frames/000000.png").expect(1, &["000000.png", "is already there"]);
    assert_eq!(fs::read(at("camera.toml")).unwrap(), before);
    run(folder.path(), "--mcap same.mcap --save-map same.mcap")
        .expect(1, &["--mcap and --save-map", "same.mcap"]);
    nothing_written(folder.path());
    run(folder.path(), "--save-map drive.map").expect(0, &[]);
    run(folder.path(), "--save-map drive.map --force").expect(0, &[]);
    assert!(fs::read(at("drive.map")).unwrap().starts_with(b"MCDRMAP"));

    fs::write(at("truth.txt"), "0 0 Car 0 0 0 1 1 2 2 1.5 1.6 4 0 1.5 20 0\n").unwrap();
    let labels = "evaluate out --kitti . --sequence 0000 --json truth.txt";
    answer(folder.path(), labels).expect(1, &["truth.txt", "is already there", "an evaluation"]);
    // JSON too, but of another kind.
    let record = fs::read(at("out/run.json")).unwrap();
    let onto_record = "evaluate out --kitti . --sequence 0000 --json out/run.json";
    answer(folder.path(), onto_record).expect(1, &["run.json is already there", "an evaluation"]);
    answer(folder.path(), "shape export --out out/run.json").expect(1, &["run.json", "a shape prior"]);
    let graph = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 2 0 0 1 0 0 1 0 1\n";
    fs::write(at("in.g2o"), graph).unwrap();
    answer(folder.path(), "graph optimise in.g2o --out new --json ./new").expect(1, &["--out and --json"]);
    answer(folder.path(), "graph optimise in.g2o --out camera.toml").expect(1, &["camera.toml", "g2o"]);
    answer(folder.path(), "graph optimise in.g2o --out in.g2o").expect(0, &[]);
    let onto_record = "graph optimise in.g2o --out in.g2o --json out/run.json";
    answer(folder.path(), onto_record).expect(1, &["run.json", "a report of an optimisation"]);
    assert_eq!(fs::read(at("out/run.json")).unwrap(), record);
    for again in ["graph optimise in.g2o --out in.g2o --json solved.json", "shape export --out prior.json"] {
        answer(folder.path(), again).expect(0, &[]);
        answer(folder.path(), again).expect(0, &[]);
    }
    no_leftovers(folder.path());
}

#[test]
fn force_removes_only_what_the_record_lists() {
    let folder = drive(12);
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("run.json"), "{}").unwrap();
    fs::write(out.join("thesis.tex"), "mine").unwrap();
    run(folder.path(), "--force").expect(1, &["out", "run.json"]);
    assert_eq!(names(&out), ["run.json", "thesis.tex"]);
    fs::remove_dir_all(&out).unwrap();

    run(folder.path(), "").expect(0, &[]);
    let listed = json(&out.join("run.json"))["files"].as_array().unwrap().len();
    assert_eq!(listed + 1, names(&out).len(), "without vehicles there is no folder in it");
    run(folder.path(), "--force").expect(0, &[]);
    fs::create_dir(out.join("notes")).unwrap();
    fs::write(out.join("notes/thesis.tex"), "mine").unwrap();
    fs::write(out.join("ego.tum"), "edited").unwrap();
    let before = names(&out);
    run(folder.path(), "--force").expect(1, &["in the way: ego.tum, notes, notes/thesis.tex"]);
    assert_eq!(names(&out), before);
    no_leftovers(folder.path());
}

#[test]
fn vehicles_of_an_earlier_run_do_not_stay() {
    let folder = drive(12);
    let out = folder.path().join("out");
    let boxes: String = (0..12).map(|k| format!("{k},100,105,150,155,0.9\n")).collect();
    fs::write(folder.path().join("boxes.csv"), boxes).unwrap();
    run(folder.path(), "--detections boxes.csv").expect(0, &[]);
    assert!(out.join("vehicles").is_dir());
    run(folder.path(), "--force").expect(0, &[]);
    assert!(!out.join("vehicles").exists());
}

#[test]
fn results_go_into_the_working_directory_and_through_links_to_folders() {
    let folder = drive(12);
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("real")).unwrap();
    symlink("real", at("link")).unwrap();
    answer(folder.path(), &format!("{USUAL} link")).expect(0, &[]);
    answer(folder.path(), &format!("{USUAL} link --force")).expect(0, &[]);
    assert!(at("link").is_symlink() && at("real/run.json").is_file());
    fs::create_dir(at("work")).unwrap();
    let here = "run ../frames --calibration ../camera.toml --height 1.5 --progress none --out .";
    for more in ["", " --force"] {
        answer(&at("work"), &format!("{here}{more}")).expect(0, &[]);
        assert!(at("work/run.json").is_file());
        no_leftovers(&at("work"));
    }
    symlink("nothing", at("dangling")).unwrap();
    answer(folder.path(), &format!("{USUAL} dangling")).expect(5, &["dangling", "link to nothing"]);
    no_leftovers(folder.path());
}

#[test]
fn results_go_into_a_mount_point() {
    let folder = drive(12);
    fs::create_dir(folder.path().join("volume")).unwrap();
    let mounted = |script: &str| {
        let mount = format!("mount -t tmpfs -o size=8m none volume || exit 99\n{script}");
        let mut command = Command::new("unshare");
        command.args(["--mount", "--map-root-user", "sh", "-c", &mount]).current_dir(folder.path());
        command.env("PROGRAM", env!("CARGO_BIN_EXE_motorcade")).env("MOTORCADE_MODELS", "none").output()
    };
    if !mounted("true").is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: this system lets no test mount a disk (unshare, mount)");
        return;
    }
    let script = format!(
        "mkdir volume/lost+found; $PROGRAM {USUAL} volume && $PROGRAM {USUAL} volume --force && ls -A volume"
    );
    let output: Answer = mounted(&script).unwrap().into();
    output.expect(0, &[]);
    assert!(
        output.stdout.ends_with("run.json\nspeeds.csv\ntracks.csv\ntracks.kitti.txt\n"),
        "{}",
        output.stdout
    );
    assert!(!output.stdout.contains("partial"), "{}", output.stdout);
}

#[test]
fn places_on_a_read_only_disk_are_refused_before_any_frame() {
    let folder = drive(12);
    let at = |name: &str| folder.path().join(name);
    fs::create_dir_all(at("disk/empty")).unwrap();
    answer(folder.path(), &format!("{USUAL} done")).expect(0, &[]);
    let read_only = |script: &str| {
        let mount = format!("mount --bind disk disk && mount -o remount,ro,bind disk || exit 99\n{script}");
        let mut command = Command::new("unshare");
        command.args(["--mount", "--map-root-user", "sh", "-c", &mount]).current_dir(folder.path());
        command.env("PROGRAM", env!("CARGO_BIN_EXE_motorcade")).env("MOTORCADE_MODELS", "none").output()
    };
    if !read_only("! touch disk/file 2> /dev/null").is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: this system lets no test mount a disk read-only (unshare, mount)");
        return;
    }
    let drive = "frames --calibration camera.toml --height 1.5";
    let commands = [
        format!("run {drive} --out disk/new"),
        format!("run {drive} --out disk/empty"),
        format!("run {drive} --out disk/new/below"),
        format!("run {drive} --out good --save-map disk/drive.map"),
        "simulate --scenario demo --frames 3 --out disk/new".to_owned(),
        "simulate --scenario demo --frames 3 --out disk/empty".to_owned(),
        "demo --frames 3 --out disk/new".to_owned(),
        "draw done --out disk/new".to_owned(),
        "calibrate frames --fps 10 --models none --out disk/found.toml".to_owned(),
        format!("ablate graph {drive} --ground-truth done/ego.tum --out disk/empty"),
    ];
    for command in commands {
        let output: Answer = read_only(&format!("$PROGRAM {command} --progress plain")).unwrap().into();
        let place = command.split(' ').find(|word| word.starts_with("disk/")).unwrap();
        output.expect(5, &[&format!("cannot write {place}"), "Read-only file system"]);
        // The program says the stage from its first frame on.
        for stage in ["odometry", "rendering", "drawing", "12"] {
            assert!(!output.stderr.contains(&format!("{stage}: ")), "{command}: {}", output.stderr);
        }
        assert_eq!(names(&at("disk")), ["empty"], "{command}");
        assert!(!at("good").exists());
    }
    assert!(names(&at("disk/empty")).is_empty());
    no_leftovers(folder.path());
}

#[test]
fn of_two_runs_into_one_new_place_the_second_is_refused_and_not_lost() {
    let folder = drive(16);
    let start = |height: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_motorcade"));
        command.args(USUAL.replace("1.5", height).split(' ').chain(["out"]));
        command.current_dir(folder.path()).env("MOTORCADE_MODELS", "none");
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let (one, two) = (start("1.5"), start("3.0"));
    let outputs: [Answer; 2] = [one, two].map(|child| child.wait_with_output().unwrap().into());
    let (won, lost) =
        if outputs[0].code == 0 { (&outputs[0], &outputs[1]) } else { (&outputs[1], &outputs[0]) };
    won.expect(0, &[]);
    lost.expect(5, &["out", "the results lie in"]);
    let place = lost.stderr.trim().rsplit("lie in ").next().unwrap();
    let heights = ["out", place].map(|run| {
        let record = json(&folder.path().join(run).join("run.json"));
        assert_eq!(record["counters"]["frames"], 16);
        record["camera_height_m"].as_f64().unwrap()
    });
    assert_eq!(heights[0] + heights[1], 4.5, "each run lies in one place");
    no_leftovers(folder.path());
}

#[test]
fn temporary_directories_of_a_killed_run_go() {
    let folder = drive(12);
    let stale = folder.path().join(".motorcade-partial-aB3dE6");
    fs::create_dir_all(stale.join("new")).unwrap();
    fs::write(stale.join("new/ego.tum"), "half").unwrap();
    run(folder.path(), "").expect(0, &[]);
    assert!(!stale.exists());
}

#[test]
fn closed_and_full_outputs_are_errors_or_nothing_but_never_a_panic() {
    let folder = drive(12);
    fs::create_dir(folder.path().join("d")).unwrap();
    let output = shell(folder.path(), "$PROGRAM inspect frames --json > /dev/full");
    output.expect(5, &["stdout", "No space left"]);
    let output = shell(folder.path(), &format!("$PROGRAM {USUAL} online --online > /dev/full"));
    output.expect(5, &["stdout", "No space left"]);
    assert_eq!(json(&folder.path().join("online/run.json"))["counters"]["frames"], 12, "results come first");
    for (script, code) in [
        (
            format!("$PROGRAM {USUAL} one --progress plain 2> /dev/full > /dev/full")
                .replace("--progress none ", ""),
            0,
        ),
        ("$PROGRAM inspect nowhere 2> /dev/full".to_owned(), 3),
        ("MOTORCADE_LOG=trace $PROGRAM inspect frames 2> /dev/full > /dev/null".to_owned(), 0),
        (format!("$PROGRAM {USUAL} two 2>&- >&-"), 0),
    ] {
        assert_eq!(shell(folder.path(), &script).code, code, "{script}");
    }
    for command in ["completions zsh", "config", "simulate --list", "--help", "inspect frames --json"] {
        let script = format!("($PROGRAM {command}; echo code $? >&2) | head -c 1 > /dev/null");
        let output = shell(folder.path(), &script);
        assert!(output.stderr.contains("code 0") && !output.stderr.contains("panicked"), "{}", output.stderr);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn names_need_not_be_text() {
    use std::os::unix::ffi::OsStrExt;
    let folder = drive(12);
    let name = std::ffi::OsStr::from_bytes(b"dr\xffve");
    fs::rename(folder.path().join("frames"), folder.path().join(name)).unwrap();
    let mut command = program(folder.path(), "run --calibration camera.toml --height 1.5 --out");
    let output: Answer = command.arg("o\u{fffd}t").arg(name).output().unwrap().into();
    output.expect(0, &[]);
    let mut command = program(folder.path(), "run --calibration camera.toml --height 1.5 --out");
    let output: Answer =
        command.arg(std::ffi::OsStr::from_bytes(b"o\xfft")).arg(name).output().unwrap().into();
    output.expect(0, &[]);
    assert!(folder.path().join(std::ffi::OsStr::from_bytes(b"o\xfft/run.json")).is_file());
}
