//! Graphs for the tests.
#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use motorcade_geometry::lie::se3;
use motorcade_graph::generate::{DriveOptions, drive};
use motorcade_graph::{Graph, Manifold, Options, VariableId, solver::Method};
use nalgebra::{Isometry3, Matrix6, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Reproducible random numbers.
pub fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// A pose with tangent entries within ±`limit`.
pub fn pose(rng: &mut impl Rng, limit: f64) -> Isometry3<f64> {
    se3::exp(&Vector6::from_fn(|_, _| rng.random_range(-limit..limit)))
}

/// A well-conditioned information matrix with all entries set.
pub fn information(rng: &mut impl Rng) -> Matrix6<f64> {
    let g = Matrix6::from_fn(|_, _| rng.random_range(-1.0..1.0));
    g * g.transpose() + Matrix6::identity()
}

/// A short drive with vehicles, noisy and unsolved.
pub fn small_drive(seed: u64) -> Graph {
    drive(&DriveOptions { frames: 25, vehicles: 3, track_length: 10, lap: 0, seed }).unwrap().graph
}

/// Options that solve to rounding.
pub fn tight(method: Method) -> Options {
    Options { method, relative_decrease: 1e-15, step_size: 1e-12, ..Options::default() }
}

/// Largest tangent component between the values of two graphs over the same ids.
pub fn difference(a: &Graph, b: &Graph) -> f64 {
    a.values().iter().map(|(id, x)| tangent(a, b, id, x.dof())).fold(0.0, f64::max)
}

fn tangent(a: &Graph, b: &Graph, id: VariableId, dof: usize) -> f64 {
    let mut d = vec![0.0; dof];
    a.values().value(id).unwrap().local(b.values().value(id).unwrap(), &mut d);
    d.iter().fold(0.0, |m, x| x.abs().max(m))
}
