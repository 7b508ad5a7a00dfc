//! `motorcade graph` on small graphs.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

mod common;

use std::fs;
use std::path::Path;

use common::{answer, json, no_leftovers};

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
