//! Simulated point tracks of scenery and road.

use nalgebra::{Point2, Point3, Vector3};

use super::options::MeasureOptions;
use super::{FrameOutlines, Noise};
use crate::drive::Drive;
use crate::hash;

/// Observation of a landmark in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointObservation {
    /// Frame of the drive.
    pub frame: usize,
    /// Index of the landmark.
    pub point: usize,
    /// Measured position \[px\].
    pub pixel: Point2<f64>,
    /// True for an outlier.
    pub outlier: bool,
}

/// Match of a road point between a frame and the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadMatch {
    /// The earlier frame.
    pub frame: usize,
    /// Measured position in it \[px\].
    pub first: Point2<f64>,
    /// Measured position in the next \[px\].
    pub second: Point2<f64>,
    /// True when the second position is an outlier.
    pub outlier: bool,
}

/// Range of depths of tracked landmarks \[m\].
const DEPTH_M: std::ops::Range<f64> = 2.0..90.0;

/// Landmarks along the road (site) \[m\]: on fronts of houses on both sides and on the carriageway.
pub(super) fn place(drive: &Drive, per_m: f64) -> Vec<Point3<f64>> {
    let (from, to) = drive.road.extent_m();
    let count = ((to - from) * per_m).max(0.0) as i64;
    let uniform = |i: i64, k: i64| f64::from(hash::unit(drive.seed ^ 0x1a2d, i, k));
    let one = |i: i64| {
        let s = from + (i as f64 + uniform(i, 0)) / per_m;
        let half = drive.road.half_width_m;
        if uniform(i, 1) < 0.2 {
            return drive.road.point(s, (2.0 * uniform(i, 2) - 1.0) * half);
        }
        let side = if uniform(i, 2) < 0.5 { -1.0 } else { 1.0 };
        drive.road.point(s, side * (half + 3.0 + 6.0 * uniform(i, 3)))
            + Vector3::z() * (7.0 * uniform(i, 4).powi(2))
    };
    (0..count).map(one).collect()
}

/// Landmarks of a frame, by rising index.
pub(super) fn observe(
    drive: &Drive,
    frame: usize,
    landmarks: &[Point3<f64>],
    outlines: &FrameOutlines,
    options: &MeasureOptions,
) -> Vec<PointObservation> {
    let Some(pose) = drive.site_from_camera.get(frame) else { return Vec::new() };
    let camera_from_site = pose.inverse();
    let mut noise = Noise::of(drive.traffic_seed, 0x70c4, frame);
    let mut out = Vec::new();
    for (point, landmark) in landmarks.iter().enumerate() {
        let seen = camera_from_site.transform_point(landmark);
        let Some(truth) = outlines.camera.project(&seen).filter(|_| DEPTH_M.contains(&seen.z)) else {
            continue;
        };
        if !outlines.camera.contains(&truth, 0.0) || outlines.occludes(&truth, seen.z, None) {
            continue;
        }
        // Always drawn, so that one option does not change the random numbers of the others.
        let (dropped, wrong) = (noise.unit() < options.drop_chance, noise.unit() < options.outlier_share);
        let pixel = disturbed(&truth, wrong, options, &mut noise);
        if !dropped && outlines.camera.contains(&pixel, 0.0) {
            out.push(PointObservation { frame, point, pixel, outlier: wrong });
        }
    }
    out
}

/// Matches of the road ahead between a frame and the next.
pub(super) fn road(
    drive: &Drive,
    frame: usize,
    here: &FrameOutlines,
    options: &MeasureOptions,
) -> Vec<RoadMatch> {
    let poses = &drive.site_from_camera;
    let (Some(first), Some(second)) = (poses.get(frame), poses.get(frame + 1)) else { return Vec::new() };
    let mut noise = Noise::of(drive.traffic_seed, 0x40ad, frame);
    let eye = Point3::from(first.translation());
    let ahead = first.transform_vector(&Vector3::z());
    let left = Vector3::new(-ahead.y, ahead.x, 0.0);
    let mut out = Vec::new();
    for _ in 0..options.road_matches {
        // Own lane, 4 to 20 m ahead, denser near, as the road's texture is in an image.
        let far = 4.0 / (1.0 - 0.8 * noise.unit());
        let place = (eye + ahead * far + left * noise.between(-1.8, 1.8)).xy();
        let (z, _) = drive.road.surface(&place);
        let point = Point3::new(place.x, place.y, z);
        let (dropped, wrong) = (noise.unit() < options.drop_chance, noise.unit() < options.outlier_share);
        let seen = |pose: &motorcade_geometry::Pose<crate::site::Site, motorcade_geometry::Camera>| {
            let p = pose.inverse().transform_point(&point);
            let pixel = here.camera.project(&p).filter(|q| here.camera.contains(q, 0.0))?;
            Some((pixel, p.z))
        };
        let (a, b) = (seen(first), seen(second));
        let disturbed_a = a.map(|(p, _)| disturbed(&p, false, options, &mut noise));
        let disturbed_b = b.map(|(p, _)| disturbed(&p, wrong, options, &mut noise));
        let hidden = a.is_none_or(|(p, depth_m)| here.occludes(&p, depth_m, None));
        if let (Some(first), Some(second), false) = (disturbed_a, disturbed_b, dropped || hidden) {
            out.push(RoadMatch { frame, first, second, outlier: wrong });
        }
    }
    out
}

fn disturbed(truth: &Point2<f64>, wrong: bool, options: &MeasureOptions, noise: &mut Noise) -> Point2<f64> {
    let spread = |noise: &mut Noise| options.pixel_sigma_px * noise.normal();
    let off = |noise: &mut Noise| if wrong { noise.between(-30.0, 30.0) } else { 0.0 };
    let (dx, dy) = (spread(noise) + off(noise), spread(noise) + off(noise));
    Point2::new(truth.x + dx, truth.y + dy)
}
