//! `motorcade graph` on small graphs.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;
use std::path::Path;

use crate::common::{answer, json, no_leftovers};

/// A square driven twice, its vertices off, its edges exact.
fn square(folder: &Path) {
    let mut text = String::new();
    for k in 0..8 {
        let (x, y) = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)][k % 4];
        let turn = std::f64::consts::FRAC_PI_2 * (k % 4) as f64;
        let off = 0.05 * k as f64;
        text += &format!("VERTEX_SE2 {k} {} {} {}\n", x + off, y - off, turn + 0.3 * off);
    }
    for k in 0..7 {
        text += &format!("EDGE_SE2 {k} {} 2 0 1.5707963267948966 100 0 0 100 0 400\n", k + 1);
    }
    text += "EDGE_SE2 0 4 0 0 0 100 0 0 100 0 400\n";
    fs::write(folder.join("square.g2o"), text).unwrap();
}

#[test]
fn a_graph_is_optimised_described_and_compared() {
    let folder = tempfile::tempdir().unwrap();
    square(folder.path());
    for method in ["lm", "gn", "dogleg"] {
        let arguments =
            format!("graph optimise square.g2o --out {method}.g2o --method {method} --json {method}.json");
        answer(folder.path(), &arguments).expect(0, &[]);
        let report = json(&folder.path().join(format!("{method}.json")));
        let (first, last) =
            (report["initial_cost"].as_f64().unwrap(), report["final_cost"].as_f64().unwrap());
        assert!(first > 0.1 && last < 1e-8, "{method}: {first} to {last}");
    }
    let info = answer(folder.path(), "graph info lm.g2o --json");
    let info: serde_json::Value = serde_json::from_str(&info.expect(0, &[]).stdout).unwrap();
    assert_eq!(
        (info["read"]["vertices_se2"].as_u64(), info["read"]["edges_se2"].as_u64()),
        (Some(8), Some(8))
    );
    assert!(info["cost_log"].as_f64().unwrap() < 1e-8);
    let compare = answer(folder.path(), "graph compare lm.g2o gn.g2o --json");
    let compare: serde_json::Value = serde_json::from_str(&compare.expect(0, &[]).stdout).unwrap();
    assert_eq!(compare["common"], 8);
    assert!(compare["raw"]["position_max_m"].as_f64().unwrap() < 1e-4);
    for (command, word) in [("info square.g2o", "8 SE(2)"), ("compare square.g2o lm.g2o", "8 in both")] {
        let table = answer(folder.path(), &format!("graph {command}"));
        assert!(table.expect(0, &[]).stdout.contains(word), "{}", table.stdout);
    }
    no_leftovers(folder.path());
}

#[test]
fn starts_costs_and_kernels_are_taken() {
    let folder = tempfile::tempdir().unwrap();
    square(folder.path());
    let more = "--init chordal --cost mqt --robust cauchy:1.0 --threads 2";
    let arguments = format!("graph optimize square.g2o --out out.g2o --json out.json {more}");
    answer(folder.path(), &arguments).expect(0, &[]);
    let report = json(&folder.path().join("out.json"));
    let words = [&report["init"], &report["cost"], &report["robust"]].map(|v| v.as_str().unwrap().to_owned());
    assert_eq!(words, ["chordal", "mqt", "cauchy:1"]);
    assert!(report["final_cost"].as_f64().unwrap() < 1e-8);
}

#[test]
fn a_time_limit_stops_and_writes_the_best_so_far() {
    let folder = tempfile::tempdir().unwrap();
    square(folder.path());
    for init in ["auto", "file", "chordal"] {
        let arguments = format!(
            "graph optimise square.g2o --out {init}.g2o --json out.json --time-limit-s 0 --init {init}"
        );
        answer(folder.path(), &arguments).expect(0, &[]);
        let report = json(&folder.path().join("out.json"));
        assert_eq!((report["termination"].as_str(), report["iterations"].as_u64()), (Some("time"), Some(1)));
        assert!(report["final_cost"].as_f64().unwrap() < 0.5 * report["file_cost"].as_f64().unwrap());
        let written = answer(folder.path(), &format!("graph compare {init}.g2o square.g2o"));
        assert!(written.expect(0, &[]).stdout.contains("8 in both"));
    }
    for wrong in ["-1", "nan", "soon"] {
        let arguments = format!("graph optimise square.g2o --out out.g2o --time-limit-s={wrong}");
        answer(folder.path(), &arguments).expect(1, &["time-limit-s", "seconds"]);
    }
    no_leftovers(folder.path());
}

/// A long chain with loops, its vertices far off: a hundred milliseconds and several iterations.
#[cfg(unix)]
fn spiral(path: &Path, n: u32) {
    let mut text = String::new();
    for k in 0..n {
        text += &format!("VERTEX_SE2 {k} {} 0 {}\n", f64::from(k) * 0.1, f64::from(k % 7) * 0.1);
    }
    for (step, turn) in [(1, 0.1_f64), (60, 6.0)] {
        let (x, y) = (turn.sin() / 0.1, (1.0 - turn.cos()) / 0.1);
        for k in 0..n - step {
            text += &format!("EDGE_SE2 {k} {} {x} {y} {turn} 1 0 0 1 0 1\n", k + step);
        }
    }
    fs::write(path, text).unwrap();
}

#[cfg(unix)]
#[test]
fn an_interrupt_writes_the_best_so_far_and_says_so() {
    use std::process::{Command, Stdio};
    use std::time::Duration;
    let folder = tempfile::tempdir().unwrap();
    spiral(&folder.path().join("spiral.g2o"), 30_000);
    let child = Command::new(assert_cmd::cargo::cargo_bin!("motorcade"))
        .args(["graph", "optimise", "spiral.g2o", "--out", "out.g2o", "--json", "out.json"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The program listens before it makes the file that becomes out.g2o.
    while fs::read_dir(folder.path()).unwrap().count() < 2 {
        std::thread::sleep(Duration::from_millis(1));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("writing what there is") && said.contains("interrupted"), "{said}");
    let report = json(&folder.path().join("out.json"));
    assert_eq!(report["termination"], "cancelled");
    let info = answer(folder.path(), "graph info out.g2o --json");
    let info: serde_json::Value = serde_json::from_str(&info.expect(0, &[]).stdout).unwrap();
    assert_eq!(info["read"]["vertices_se2"], 30_000);
    let (written, reported) = (info["cost_log"].as_f64().unwrap(), report["final_cost"].as_f64().unwrap());
    assert!((written / reported - 1.0).abs() < 1e-6, "{written} {reported}");
    no_leftovers(folder.path());
}

#[test]
fn bad_graphs_are_named_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    square(folder.path());
    let optimise = |input: &str, more: &str| {
        answer(folder.path(), &format!("graph optimise {input} --out out.g2o {more}"))
    };
    fs::write(folder.path().join("short.g2o"), "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 zero 0 0\n").unwrap();
    optimise("short.g2o", "").expect(3, &["short.g2o:2"]);
    fs::write(folder.path().join("lost.g2o"), "VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 7 1 0 0 1 0 0 1 0 1\n")
        .unwrap();
    optimise("lost.g2o", "").expect(3, &["lost.g2o:2", "7"]);
    let missing = optimise("nowhere.g2o", "");
    missing.expect(3, &["nowhere.g2o"]);
    assert_eq!(missing.stderr.matches("No such file").count(), 1, "{}", missing.stderr);
    answer(folder.path(), "graph info nowhere.g2o").expect(3, &["nowhere.g2o"]);
    answer(folder.path(), "graph compare square.g2o nowhere.g2o").expect(3, &["nowhere.g2o"]);
    optimise("square.g2o", "--method newton").expect(1, &["newton"]);
    optimise("square.g2o", "--robust cauchy:-1").expect(1, &["cauchy:-1"]);
    optimise("square.g2o", "--init guess").expect(1, &["guess"]);
    optimise("square.g2o", "--json square.g2o/report.json").expect(5, &["square.g2o/report.json"]);
    answer(folder.path(), "graph optimise square.g2o --out square.g2o/out").expect(5, &["square.g2o/out"]);
    assert!(!folder.path().join("out.g2o").exists());
    no_leftovers(folder.path());
}
