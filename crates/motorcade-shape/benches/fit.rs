//! Time of a fit: `cargo bench -p motorcade-shape`.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use motorcade_shape::fit::{FitOptions, MeasuredRoad, Observation, ObservedKeypoint, ShapeFitter};
use motorcade_shape::{BodyType, Layout, ShapePrior, project};
use motorcade_testing::{CAMERA, CAMERA_HEIGHT_M, on_road};
use nalgebra::Vector2;

/// A saloon seen from behind its left, every seventh point far off.
fn scene(prior: &ShapePrior, z: f64) -> Observation {
    let pose = on_road(3.0, z, -0.5);
    let shape = prior.coefficients_of(BodyType::Saloon).unwrap_or_default();
    let points = project(prior, shape, &pose, &CAMERA).into_iter().enumerate().map(|(i, p)| {
        let jitter = Vector2::new((i as f64 * 1.7).sin(), (i as f64 * 2.3).cos()) * 1.5;
        let stray = if i % 7 == 3 { Vector2::new(40.0, -25.0) } else { Vector2::zeros() };
        let confidence = if p.visible { 0.8 } else { 0.02 };
        ObservedKeypoint::new(p.pixel.unwrap_or_default() + jitter + stray, confidence)
    });
    let mut observation = Observation::new(points.collect(), 2.0);
    observation.road = Some(MeasuredRoad::level(CAMERA_HEIGHT_M));
    observation
}

fn fits(criterion: &mut Criterion) {
    for (name, layout) in [("14 keypoints", Layout::Car14), ("36 keypoints", Layout::Car36)] {
        let fitter = ShapeFitter::new(ShapePrior::of_family(layout), FitOptions::default());
        let observation = scene(fitter.prior(), 14.0);
        criterion.bench_function(&format!("one vehicle, {name}"), |b| {
            b.iter(|| fitter.fit(&CAMERA, black_box(&observation)))
        });
        let track: Vec<_> = (0..50).map(|k| scene(fitter.prior(), 10.0 + 0.4 * f64::from(k))).collect();
        criterion.bench_function(&format!("track of 50 frames, {name}"), |b| {
            b.iter(|| fitter.fit_track(&CAMERA, black_box(&track)))
        });
    }
    criterion.bench_function("own prior", |b| b.iter(|| ShapePrior::of_family(Layout::Car36)));
}

criterion_group!(benches, fits);
criterion_main!(benches);
