//! Time of a fit: `cargo bench -p motorcade-shape`.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use motorcade_geometry::{PinholeCamera, Pose};
use motorcade_shape::fit::{FitOptions, ImageBox, Observation, ObservedKeypoint, RoadPlane, ShapeFitter};
use motorcade_shape::{BodyType, Layout, ShapePrior, project};
use nalgebra::{Matrix3, Vector2, Vector3};

/// A saloon seen from behind its left, every seventh point far off.
fn scene(prior: &ShapePrior, camera: &PinholeCamera, z: f64) -> Observation {
    let (s, c) = 0.5_f64.sin_cos();
    let rotation = Matrix3::from_columns(&[Vector3::new(s, 0.0, c), Vector3::new(-c, 0.0, s), -Vector3::y()]);
    let pose = Pose::from_matrix(&rotation, &Vector3::new(3.0, 1.65, z));
    let shape = prior.coefficients_of(BodyType::Saloon).unwrap_or_default();
    let points = project(prior, shape, &pose, camera).into_iter().enumerate().map(|(i, p)| {
        let jitter = Vector2::new((i as f64 * 1.7).sin(), (i as f64 * 2.3).cos()) * 1.5;
        let stray = if i % 7 == 3 { Vector2::new(40.0, -25.0) } else { Vector2::zeros() };
        let confidence = if p.visible { 0.8 } else { 0.02 };
        ObservedKeypoint::new(p.pixel.unwrap_or_default() + jitter + stray, confidence)
    });
    let mut observation = Observation::new(points.collect(), 2.0);
    observation.road = Some(RoadPlane::level(1.65));
    observation
}

fn fits(criterion: &mut Criterion) {
    let camera = PinholeCamera { fx: 720.0, fy: 720.0, cx: 610.0, cy: 175.0, width: 1242, height: 375 };
    for (name, layout) in [("14 keypoints", Layout::Car14), ("36 keypoints", Layout::Car36)] {
        let fitter = ShapeFitter::new(ShapePrior::of_family(layout), FitOptions::default());
        let mut observation = scene(fitter.prior(), &camera, 14.0);
        criterion.bench_function(&format!("one vehicle, {name}"), |b| {
            b.iter(|| fitter.fit(&camera, black_box(&observation)))
        });
        let track: Vec<_> =
            (0..50).map(|k| scene(fitter.prior(), &camera, 10.0 + 0.4 * f64::from(k))).collect();
        criterion.bench_function(&format!("track of 50 frames, {name}"), |b| {
            b.iter(|| fitter.fit_track(&camera, black_box(&track)))
        });
        observation.image_box = Some(ImageBox::new([700.0, 150.0, 900.0, 270.0], &camera));
        criterion.bench_function(&format!("one vehicle with box, {name}"), |b| {
            b.iter(|| fitter.fit(&camera, black_box(&observation)))
        });
    }
    criterion.bench_function("own prior", |b| b.iter(|| ShapePrior::of_family(Layout::Car36)));
}

criterion_group!(benches, fits);
criterion_main!(benches);
