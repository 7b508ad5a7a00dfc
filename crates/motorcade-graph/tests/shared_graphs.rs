//! Public benchmarks, where they are at hand: the known optima from the starts in the files or chordal ones.

mod common;

use motorcade_graph::Options;
use motorcade_graph::command::{OptimiseReport, OptimiseRequest, Start, compare, info, optimise};
use motorcade_graph::factors::PoseResidual;

fn solve(name: &str, cost: PoseResidual, init: Start, robust: Option<&str>) -> Option<OptimiseReport> {
    let input = common::shared(&format!("posegraphs/{name}.g2o"))?;
    let options = Options { relative_decrease: 1e-9, ..Options::default() };
    let robust = robust.map(|r| r.parse().unwrap());
    Some(optimise(&OptimiseRequest { input, options, cost, init, robust, ..Default::default() }).unwrap())
}

/// Optima of the benchmark's own table, printed with seven digits or fewer.
fn reaches(name: &str, init: Start, mqt: f64, log: f64, relative: f64) {
    for (cost, expected) in [(PoseResidual::Mqt, mqt), (PoseResidual::Log, log)] {
        let Some(report) = solve(name, cost, init, None) else { return };
        let off = report.final_cost / expected - 1.0;
        assert!(off.abs() < relative, "{name} {cost:?}: {} against {expected}", report.final_cost);
    }
}

#[test]
fn small_grid() {
    reaches("smallGrid3D", Start::File, 458.1538, 1035.8507, 1e-6);
    reaches("smallGrid3D", Start::Chordal, 458.1538, 1035.8507, 1e-6);
}

#[test]
fn parking_garage() {
    reaches("parking-garage", Start::File, 1.238691, 1.268380, 5e-6);
    reaches("parking-garage", Start::Chordal, 1.238691, 1.268380, 5e-6);
}

#[test]
fn sphere() {
    reaches("sphere2500", Start::File, 727.1504, 1351.403, 1.1e-6);
}

#[test]
fn torus() {
    reaches("torus3D", Start::Chordal, 14575.0, 24235.0, 2e-5);
}

#[test]
fn multi_body_drive() {
    reaches("mb1000", Start::File, 13661.0, 23289.0, 3e-5);
}

#[test]
fn cubicle_is_repaired_and_solved() {
    let Some(chordal) = solve("cubicle", PoseResidual::Log, Start::Chordal, None) else { return };
    assert_eq!(chordal.read.clamped_information, 5021);
    assert!(
        chordal.final_cost < 0.03 * chordal.initial_cost && chordal.initial_cost < 0.01 * chordal.file_cost
    );
}

#[test]
fn cauchy_recovers_the_clean_solution() {
    let Some(dirty) = solve("mb1000_out10", PoseResidual::Log, Start::File, Some("cauchy:3.55")) else {
        return;
    };
    let Some(clean) = common::shared("posegraphs/mb1000.g2o") else { return };
    let folder = tempfile::tempdir().unwrap();
    let request = |input: std::path::PathBuf, output: &str, robust: Option<&str>| OptimiseRequest {
        input,
        output: Some(folder.path().join(output)),
        robust: robust.map(|r| r.parse().unwrap()),
        ..Default::default()
    };
    optimise(&request(clean, "clean.g2o", None)).unwrap();
    optimise(&request(dirty.input.clone(), "robust.g2o", Some("cauchy:3.55"))).unwrap();
    optimise(&request(dirty.input.clone(), "plain.g2o", None)).unwrap();
    let distance = |file: &str| {
        let report = compare(&folder.path().join("clean.g2o"), &folder.path().join(file)).unwrap();
        report.aligned.position_rms_m
    };
    let (robust, plain) = (distance("robust.g2o"), distance("plain.g2o"));
    println!("from the clean solution: cauchy {robust:.3} m, least squares {plain:.3} m");
    assert!(robust < 0.3 * plain);
}

#[test]
fn info_agrees_with_the_report() {
    let Some(report) = solve("smallGrid3D", PoseResidual::Mqt, Start::File, None) else { return };
    let info = info(&report.input).unwrap();
    assert_eq!((info.read.vertices_se3, info.read.edges_se3, info.components.len()), (125, 297, 1));
    assert!((info.cost_mqt - report.file_cost).abs() < 1e-9 * info.cost_mqt);
}
