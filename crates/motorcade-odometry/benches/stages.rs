//! Time of each stage on images of KITTI's size: `cargo bench -p motorcade-odometry --bench stages`.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use image::GrayImage;
use motorcade_geometry::{Camera, PinholeCamera, Pose, World};
use motorcade_odometry::stages::{
    BundleProblem, KeyframeObservation, Observation, PoseRefiner, RoadPixels, RoadScratch, RoadView,
    align_road,
};
use motorcade_odometry::{
    BundleOptions, CornerOptions, KltOptions, Odometry, OdometryOptions, PoseOnlyOptions, Pyramid, Request,
    RoadInput, RoadOptions, RoadTracker, StaticMask, detect, track_checked,
};
use motorcade_testing::street_image::{HEIGHT_M, StreetPose, depth, street_image};
use nalgebra::{Matrix2, Point2, Point3, Vector2, Vector3, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const CAMERA: PinholeCamera =
    PinholeCamera { fx: 720.0, fy: 720.0, cx: 610.0, cy: 175.0, width: 1242, height: 375 };
const LEVELS: usize = 4;
/// Distance between two frames \[m\]: 36 km/h at 10 frames a second.
const STEP_M: f64 = 1.0;

fn pyramid_at(along_m: f64) -> Pyramid {
    Pyramid::new(&street_image(&CAMERA, &StreetPose::along(along_m)), LEVELS)
}

/// Pose of a camera that has moved `way_m` straight ahead.
fn ahead(way_m: f64) -> Pose<Camera, World> {
    Pose::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, -way_m))
}

/// Corners in the image at the origin, and their points in the world.
fn corners(pyramid: &Pyramid, count: usize) -> Vec<(Point2<f64>, Point3<f64>)> {
    // Denser than a drive needs, for a street that is smooth.
    let options = CornerOptions {
        columns: 62,
        per_cell: 4,
        distance_px: 4.0,
        least_eigenvalue: 4.0,
        ..CornerOptions::default()
    };
    let found = detect(pyramid.level(0), &[], |_, _| true, &options);
    assert!(found.len() >= count, "{} corners", found.len());
    let spread = found.len() / count;
    let one = |p: &Point2<f64>| {
        (*p, Point3::from(CAMERA.ray(p) * depth(&CAMERA, &StreetPose::along(0.0), p.x, p.y)))
    };
    found.iter().step_by(spread).map(one).take(count).collect()
}

fn images(criterion: &mut Criterion) {
    let image = street_image(&CAMERA, &StreetPose::along(0.0));
    let mut pyramid = Pyramid::new(&image, LEVELS);
    criterion.bench_function("pyramid", |b| b.iter(|| pyramid.refill(black_box(&image), LEVELS)));
    criterion.bench_function("corner detection", |b| {
        b.iter(|| detect(black_box(&pyramid).level(0), &[], |_, _| true, &CornerOptions::default()))
    });
}

fn tracking(criterion: &mut Criterion) {
    let (from, to) = (pyramid_at(0.0), pyramid_at(STEP_M));
    // As the odometry asks: expected within a pixel, the growth known.
    let request = |(pixel, point): &(Point2<f64>, Point3<f64>)| {
        let moved = ahead(STEP_M).transform_point(point);
        let expected = CAMERA.project(&moved)? + Vector2::new(0.6, -0.4);
        let from_offset = Matrix2::identity() * (moved.z / point.z);
        Some(Request { from: *pixel, expected, from_offset, top_level: 2 })
    };
    let requests: Vec<Request> = corners(&from, 800).iter().filter_map(request).collect();
    let options = KltOptions::default();
    let follow = || requests.iter().filter(|r| track_checked(&from, &to, r, &options).is_some()).count();
    assert!(2 * follow() > requests.len(), "{} of {} followed", follow(), requests.len());
    criterion.bench_function("KLT there and back, 800 patches", |b| b.iter(|| black_box(follow())));
}

fn pose(criterion: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let truth = ahead(STEP_M) * Pose::<World, World>::exp(&Vector6::new(0.002, 0.01, 0.0, 0.0, 0.0, 0.0));
    let mut observe = |(i, (_, point)): (usize, (Point2<f64>, Point3<f64>))| {
        let stray = if i % 10 == 0 { 30.0 } else { 0.5 };
        let off = Vector2::from_fn(|_, _| rng.random_range(-stray..stray));
        Some(Observation {
            point_in_world: point,
            pixel: CAMERA.project(&truth.transform_point(&point))? + off,
        })
    };
    let all = corners(&pyramid_at(0.0), 400).into_iter().enumerate();
    let observations: Vec<_> = all.filter_map(&mut observe).collect();
    let (mut refiner, options) = (PoseRefiner::default(), PoseOnlyOptions::default());
    criterion.bench_function("pose from 400 points", |b| {
        b.iter(|| refiner.refine(&CAMERA, &ahead(0.9 * STEP_M), black_box(&observations), &options))
    });
}

/// 13 keyframes 2 m apart, 3 of them fixed, and 800 points, each observed from 6 of them.
fn window() -> BundleProblem {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let truth: Vec<_> = (0..13).map(|k| ahead(2.0 * f64::from(k))).collect();
    let mut problem = BundleProblem {
        poses: truth.clone(),
        fixed: (0..truth.len()).map(|k| k < 3).collect(),
        ..BundleProblem::default()
    };
    for i in 0..800 {
        let first = i % (truth.len() - 5);
        let point = Point3::new(
            rng.random_range(-6.0..6.0),
            rng.random_range(-3.0..HEIGHT_M),
            2.0 * first as f64 + rng.random_range(15.0..45.0),
        );
        let mut see = |pose: usize| {
            let off = Vector2::from_fn(|_, _| rng.random_range(-0.8..0.8));
            Some(KeyframeObservation {
                pose,
                pixel: CAMERA.project(&truth[pose].transform_point(&point))? + off,
            })
        };
        problem.observations.push((first..first + 6).filter_map(&mut see).collect());
        problem.points.push(point + Vector3::from_fn(|_, _| rng.random_range(-0.3..0.3)));
    }
    // The newest pose is the one that tracking alone has placed.
    for (k, pose) in problem.poses.iter_mut().enumerate().skip(3) {
        let spread = if k == 12 { 0.01 } else { 0.001 };
        *pose = pose.retract(&Vector6::from_fn(|_, _| rng.random_range(-spread..spread)));
    }
    problem
}

fn bundle(criterion: &mut Criterion) {
    let (window, options) = (window(), BundleOptions::default());
    criterion.bench_function("bundle adjustment, 13 keyframes, 800 points", |b| {
        b.iter_batched_ref(|| window.clone(), |w| w.solve(&CAMERA, &options), BatchSize::SmallInput)
    });
}

fn road(criterion: &mut Criterion) {
    let (reference, current) = (pyramid_at(0.0), pyramid_at(2.0 * STEP_M));
    let view = RoadView {
        row_share: 0.0,
        camera: &CAMERA,
        current: &current,
        reference: &reference,
        reference_from_current: ahead(2.0 * STEP_M).inverse().cast(),
        guess: Vector3::new(0.0, 0.98 / HEIGHT_M, 0.005),
        road_in_reference: RoadPixels::everywhere(),
    };
    let (mut scratch, options) = (RoadScratch::default(), RoadOptions::default());
    let mut found = || align_road(black_box(&view), |_| true, &options, &mut scratch);
    let height_m = found().map(|plane| 1.0 / plane.m.norm());
    assert!(height_m.is_some_and(|h| (h / HEIGHT_M - 1.0).abs() < 0.01), "{height_m:?}");
    criterion.bench_function("road alignment", |b| b.iter(&mut found));
}

/// A drive along the street, begun anew at its end.
struct Drive<'a> {
    images: &'a [GrayImage],
    odometry: Odometry,
    road: RoadTracker,
    next: usize,
}

impl<'a> Drive<'a> {
    /// Frames until the map, the road plane and all memory are there.
    const WARM: usize = 20;

    fn new(images: &'a [GrayImage]) -> Self {
        let odometry = Odometry::new(CAMERA, OdometryOptions::default());
        let road = RoadTracker::new(CAMERA, RoadOptions::default());
        let mut out = Self { images, odometry, road, next: 0 };
        for _ in 0..Self::WARM {
            out.frame();
        }
        assert!(!out.road.measurements().is_empty(), "the road was not found");
        out
    }

    fn frame(&mut self) {
        let Self { images, odometry, road, next } = self;
        let timestamp_ns = *next as i64 * 100_000_000;
        let pyramid = odometry.process(timestamp_ns, &images[*next], &StaticMask::default());
        let trajectory = odometry.trajectory();
        let segment = trajectory.frames[*next].segment;
        let input = RoadInput {
            frame: *next,
            timestamp_ns,
            segment,
            pyramid: &pyramid,
            vehicles: &[],
            masked: false,
        };
        road.process(&input, |k| trajectory.measured_pose(k), |_| true);
        *next += 1;
    }

    /// Time of the next frame.
    fn timed(&mut self) -> Duration {
        if self.next == self.images.len() {
            *self = Self::new(self.images);
        }
        let start = Instant::now();
        self.frame();
        start.elapsed()
    }
}

fn whole_frame(criterion: &mut Criterion) {
    let images: Vec<_> =
        (0..60).map(|k| street_image(&CAMERA, &StreetPose::along(STEP_M * f64::from(k)))).collect();
    let mut drive = Drive::new(&images);
    criterion.bench_function("whole frame, odometry and road", |b| {
        b.iter_custom(|frames| (0..frames).map(|_| drive.timed()).sum())
    });
}

criterion_group!(benches, images, tracking, pose, bundle, road, whole_frame);
criterion_main!(benches);
