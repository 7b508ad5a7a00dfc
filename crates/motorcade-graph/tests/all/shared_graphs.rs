//! Public benchmarks, where they are at hand: the known optima from the starts in the files or chordal ones.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)] // helpers of tests are tests

use std::time::Instant;

use motorcade_graph::factors::{Between, PoseResidual};
use motorcade_graph::g2o::{ReadOptions, ReadSummary};
use motorcade_graph::solver::{Control, Report, Solver};
use motorcade_graph::start::{self, Start};
use motorcade_graph::{Factor, FactorId, Graph, Options, Robust, RobustKernel, g2o};

/// A file, solved.
struct Solved {
    read: ReadSummary,
    file_cost: f64,
    init: Start,
    report: Report,
}

fn solve(name: &str, residual: PoseResidual, init: Start) -> Option<Solved> {
    let path = motorcade_testing::shared(&format!("posegraphs/{name}.g2o"))?;
    let options = Options { relative_decrease: 1e-9, ..Options::default() };
    let mut document = g2o::read(&path, &ReadOptions { residual, ..ReadOptions::default() }).unwrap();
    let graph = &mut document.graph;
    graph.anchor_components().unwrap();
    let (file_cost, control) = (graph.cost().unwrap(), Control::default());
    let smooth = (init == Start::Auto).then(|| start::descend(graph, &options, &control).unwrap()).flatten();
    let (init, report) = match smooth {
        Some(report) => (Start::File, report),
        None => {
            let init = start::prepare(graph, init, &options, &control, Instant::now()).unwrap();
            (init, Solver::new(options).unwrap().optimise(graph).unwrap())
        }
    };
    Some(Solved { read: document.summary, file_cost, init, report })
}

/// Optima of the benchmark's own table, printed with seven digits or fewer.
fn reaches(name: &str, init: Start, mqt: f64, log: f64, relative: f64) {
    for (cost, expected) in [(PoseResidual::Mqt, mqt), (PoseResidual::Log, log)] {
        let Some(report) = solve(name, cost, init) else { return };
        let off = report.report.final_cost / expected - 1.0;
        assert!(off.abs() < relative, "{name} {cost:?}: {} against {expected}", report.report.final_cost);
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
    let Some(chordal) = solve("cubicle", PoseResidual::Log, Start::Chordal) else { return };
    assert_eq!(chordal.read.clamped_information, 5021);
    assert!(
        chordal.report.final_cost < 0.03 * chordal.report.initial_cost
            && chordal.report.initial_cost < 0.01 * chordal.file_cost
    );
}

/// χ²₆ at 0.99.
const GATE: f64 = 16.81;

/// Root mean square difference of the second end of every edge as seen from the first \[m\].
fn relative_difference(a: &Graph, b: &Graph) -> f64 {
    let seen = |graph: &Graph, f: &dyn Factor| {
        let pose = |k: usize| *graph.values().get::<nalgebra::Isometry3<f64>>(f.variables()[k]).unwrap();
        pose(0).inv_mul(&pose(1)).translation.vector
    };
    let sum: f64 = a.factors().map(|(_, f)| (seen(a, f) - seen(b, f)).norm_squared()).sum();
    (sum / a.factors().len() as f64).sqrt()
}

#[test]
fn cauchy_recovers_the_clean_solution() {
    let Some(path) = motorcade_testing::shared("posegraphs/mb1000_out10.g2o") else { return };
    // The file numbers cameras from 0 and vehicles from 100000; only sightings of vehicles are ever wrong.
    let sighting = |document: &g2o::Document, f: &dyn Factor| {
        let id = |k: usize| document.vertices[f.variables()[k].index()].0;
        id(0) < 100_000 && id(1) >= 100_000
    };
    let read = || {
        let mut document = g2o::read(&path, &ReadOptions::default()).unwrap();
        document.graph.anchor_components().unwrap();
        let sightings: Vec<FactorId> =
            document.graph.factors().filter(|(_, f)| sighting(&document, *f)).map(|(id, _)| id).collect();
        (document.graph, sightings)
    };
    let solve = |kernel: Option<RobustKernel>| {
        let (mut graph, sightings) = read();
        for &id in &sightings {
            let factor = graph.remove_factor(id).unwrap();
            let (v, z) = (factor.variables(), factor.relative_pose().unwrap());
            let between = Between::new(v[0], v[1], *z.measurement, *z.information).unwrap();
            match kernel {
                Some(kernel) => graph.add_factor(Robust::new(between, kernel)).unwrap(),
                None => graph.add_factor(between).unwrap(),
            };
        }
        motorcade_graph::optimise(&mut graph, &Options::default()).unwrap();
        graph
    };
    let robust = solve(Some(RobustKernel::Cauchy(3.55)));
    let plain = solve(None);
    // Clean: least squares on the sightings within the gate, from the robust solution.
    let (mut clean, sightings) = read();
    *clean.values_mut() = robust.values().clone();
    let far = |id: &FactorId| clean.factor(*id).unwrap().squared_norm(robust.values()).unwrap() > GATE;
    let gated: Vec<FactorId> = sightings.iter().copied().filter(far).collect();
    for &id in &gated {
        clean.remove_factor(id);
    }
    let report = motorcade_graph::optimise(&mut clean, &Options::default()).unwrap();
    let freedom = (6 * clean.factors().len() - report.unknowns) as f64;
    let (near, far) = (relative_difference(&clean, &robust), relative_difference(&clean, &plain));
    println!(
        "gated {} (367 wrong), χ²/freedom {:.3}, from clean: cauchy {near:.3} m, least squares {far:.3} m",
        gated.len(),
        report.final_cost / freedom
    );
    // All 367 wrong edges and few others; what is left fits its own noise.
    assert!((367..=460).contains(&gated.len()), "{}", gated.len());
    assert!((0.8..1.1).contains(&(report.final_cost / freedom)));
    assert!(near < 0.1 * far);
}

/// sphere2500 is ordered by nested dissection.
#[test]
fn threads_change_no_bit_of_a_dissected_graph() {
    let Some(input) = motorcade_testing::shared("posegraphs/sphere2500.g2o") else { return };
    let run = |threads| {
        let mut graph = g2o::read(&input, &ReadOptions::default()).unwrap().graph;
        graph.anchor_components().unwrap();
        let options = Options { threads, ..Options::default() };
        let report = motorcade_graph::optimise(&mut graph, &options).unwrap();
        report.iterations.iter().map(|r| r.cost.to_bits()).collect::<Vec<_>>()
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(5));
}

#[test]
fn automatic_start_is_never_worse_than_the_others() {
    for name in
        ["smallGrid3D", "parking-garage", "sphere2500", "torus3D", "sphere_bignoise_vertex3", "mb1000"]
    {
        let Some(auto) = solve(name, PoseResidual::Log, Start::Auto) else { return };
        for start in [Start::File, Start::SpanningTree, Start::Chordal] {
            let Some(other) = solve(name, PoseResidual::Log, start) else { return };
            println!(
                "{name}: {start:?} {:.8e}, auto took {:?} {:.8e}",
                other.report.final_cost, auto.init, auto.report.final_cost
            );
            assert!(auto.report.final_cost <= other.report.final_cost * (1.0 + 1e-6), "{name} {start:?}");
        }
    }
}
