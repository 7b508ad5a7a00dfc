//! The flow of the commands on public graphs, where they are at hand, and on generated ones.

use motorcade_graph::factors::PoseResidual;
use motorcade_graph::g2o::to_string;
use motorcade_graph::generate::{DriveOptions, drive};
use motorcade_graph::solver::Termination;
use motorcade_graph::start::Start;
use motorcade_graph::{Graph, Options, VariableId};
use motorcade_testing::shared;
use nalgebra::{Isometry3, Vector3};

use super::{OptimiseReport, OptimiseRequest, compare, info, optimise};

fn solve(name: &str, cost: PoseResidual, init: Start) -> Option<OptimiseReport> {
    let input = shared(&format!("posegraphs/{name}.g2o"))?;
    let options = Options { relative_decrease: 1e-9, ..Options::default() };
    Some(optimise(&OptimiseRequest { input, options, cost, init, ..Default::default() }).unwrap().0)
}

#[test]
fn two_starts_end_in_the_same_place() {
    let Some(input) = shared("posegraphs/sphere2500.g2o") else { return };
    let folder = tempfile::tempdir().unwrap();
    let outputs = [Start::File, Start::Chordal].map(|init| {
        let output = folder.path().join(format!("{init:?}.g2o"));
        let options = Options { relative_decrease: 1e-12, ..Options::default() };
        let request = OptimiseRequest { input: input.clone(), init, options, ..Default::default() };
        std::fs::write(&output, optimise(&request).unwrap().1).unwrap();
        output
    });
    let report = compare(&outputs[0], &outputs[1]).unwrap();
    assert_eq!((report.common, report.only_first, report.only_second), (2500, 0, 0));
    assert!(report.raw.position_max_m < 1e-3 && report.aligned.rotation_max_rad < 1e-4, "{report:?}");
    let moved = compare(&input, &outputs[0]).unwrap();
    assert!(moved.raw.position_max_m > 1.0 && moved.cost_log.1.unwrap() < moved.cost_log.0);
}

#[test]
fn a_slow_solve_names_the_chordal_start() {
    let Some(file) = solve("torus3D", PoseResidual::Log, Start::File) else { return };
    let Some(chordal) = solve("torus3D", PoseResidual::Log, Start::Chordal) else { return };
    assert!(file.hint.is_some_and(|h| h.contains("--init chordal")) && chordal.hint.is_none());
    assert!(chordal.final_cost < 0.5 * file.final_cost && chordal.iterations < 10);
}

/// With time for the choice of a start the chordal one is taken here; without, no other than the file's is even tried. A long first factorisation is given
/// up then.
#[test]
fn time_limit_is_for_the_choice_of_a_start_too() {
    let Some(input) = shared("posegraphs/sphere_bignoise_vertex3.g2o") else { return };
    let options = Options { time_limit_s: Some(0.0), ..Options::default() };
    let (report, _) = optimise(&OptimiseRequest { input, options, ..Default::default() }).unwrap();
    assert_eq!((report.init, report.termination), (Start::File, Termination::Time));
    assert!(
        report.rows.len() <= 1 && report.final_cost <= (1.0 + 1e-9) * report.file_cost,
        "{:?}",
        report.rows
    );
}

/// The flow of `graph optimise`: every file is solved from a chordal start, in both residuals; what is written costs,
/// read again, what the report says.
#[test]
fn written_graphs_cost_what_the_report_says() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["smallGrid3D", "parking-garage", "sphere_bignoise_vertex3", "mb1000_out10"] {
        let Some(input) = shared(&format!("posegraphs/{name}.g2o")) else { return };
        for cost in [PoseResidual::Log, PoseResidual::Mqt] {
            let output = folder.path().join("out.g2o");
            let request =
                OptimiseRequest { input: input.clone(), cost, init: Start::Chordal, ..Default::default() };
            let (report, text) = optimise(&request).unwrap();
            std::fs::write(&output, text).unwrap();
            assert!(report.final_cost < report.file_cost && report.rows.len() == report.iterations, "{name}");
            let written = info(&output).unwrap();
            let again = if cost == PoseResidual::Log { written.cost_log } else { written.cost_mqt };
            assert!((again / report.final_cost - 1.0).abs() < 1e-9, "{name} {cost:?}: {again}");
        }
    }
}

#[test]
fn info_agrees_with_the_report() {
    let Some(report) = solve("smallGrid3D", PoseResidual::Mqt, Start::File) else { return };
    let info = info(&report.input).unwrap();
    assert_eq!((info.read.vertices_se3, info.read.edges_se3, info.components.len()), (125, 297, 1));
    assert!((info.cost_mqt - report.file_cost).abs() < 1e-9 * info.cost_mqt);
}

#[test]
fn auto_leaves_the_start_in_the_file_where_a_step_from_there_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let solve = |graph: &Graph, init| -> OptimiseReport {
        let input = folder.path().join("in.g2o");
        let ids: Vec<_> = graph.values().iter().map(|(id, _)| (id.index() as u64, id)).collect();
        std::fs::write(&input, to_string(graph, &ids)).unwrap();
        optimise(&OptimiseRequest { input, init, ..Default::default() }).unwrap().0
    };
    let mut graph =
        drive(&DriveOptions { frames: 25, vehicles: 3, track_length: 10, lap: 0, seed: 9 }).unwrap().graph;
    let (auto, file) = (solve(&graph, Start::Auto), solve(&graph, Start::File));
    assert_eq!((auto.init, auto.init_s), (Start::File, 0.0));
    assert_eq!((auto.final_cost, auto.iterations), (file.final_cost, file.iterations));
    // Scattered over a cube of 6 m, in all directions.
    let ids: Vec<VariableId> = graph.values().iter().map(|(id, _)| id).collect();
    for (k, &id) in ids.iter().enumerate().skip(1) {
        let x = |step: f64| 3.0 * (step * k as f64).sin();
        let lost = Isometry3::new(Vector3::new(x(1.3), x(2.1), x(3.7)), Vector3::new(x(0.7), x(1.9), x(2.9)));
        graph.values_mut().set(id, lost).unwrap();
    }
    let lost = solve(&graph, Start::Auto);
    assert!(lost.init != Start::File && lost.init_s > 0.0);
    assert!((lost.final_cost / file.final_cost - 1.0).abs() < 1e-6);
}
