//! Something large that stands far behind the traffic and is called a vehicle: a building, a hoarding.
//!
//! Its boxes grow and move as those of a vehicle `k` times nearer that drives along with the camera at `1 − 1/k` of its speed: one
//! camera cannot tell the two apart by the boxes alone. Two things do. The background keeps one place with a height that no vehicle has, and
//! it does not touch the road where a vehicle of the size of its class would.

use motorcade_geometry::robust::upper_median_by;
use nalgebra::{Matrix4, SymmetricEigen, Vector3, Vector4};

use super::drive::Drive;
use crate::box_fit::{edge_sigma_px, road_height_sigma_m};
use crate::external::ExternalTrack;
use crate::ground::GroundFrame;
use crate::track::{Track, TrackBox};
use crate::trajectory::VehicleTrajectory;

/// True when the boxes of a track that appears to drive are those of something too large for a vehicle that stands, and the
/// vehicle would hang above the road.
pub(super) fn is_background<V: Fn(&Track) -> ExternalTrack>(
    drive: &Drive<'_, V>,
    track: &Track,
    vehicle: &VehicleTrajectory,
) -> bool {
    drive.moves(vehicle) && hangs(drive, track, vehicle) && stands_far(drive, track)
}

/// True when the lower edges lie above the road at the vehicle's places by more than the road's height may err.
fn hangs<V: Fn(&Track) -> ExternalTrack>(
    drive: &Drive<'_, V>,
    track: &Track,
    vehicle: &VehicleTrajectory,
) -> bool {
    let first = vehicle.states.first().map_or(0, |s| s.frame);
    let box_fit = &drive.options.advanced.box_fit;
    let sigmas_above = |b: &TrackBox| {
        let state = vehicle.states.get(b.frame.checked_sub(first)?)?;
        let ground = drive.grounds.get(b.frame)?;
        let place = ground
            .world_from_camera
            .inverse()
            .transform_point(&state.world_from_vehicle.translation().into());
        let (ahead_m, left_m) = (place.coords.dot(&ground.ahead()), place.coords.dot(&ground.left()));
        let bbox = b.observed.bbox;
        let ray = drive.camera.ray(&nalgebra::Point2::new((bbox.x1 + bbox.x2) / 2.0, bbox.y2));
        let along = ray.dot(&ground.ahead());
        let above_m = ground.height_m + (ray * (ahead_m / along)).dot(&ground.up) - ground.rise(ahead_m).0;
        (b.observed.edges[3] && along > 0.0 && ahead_m > 0.0)
            .then(|| above_m / road_height_sigma_m(ground, ahead_m, left_m, box_fit))
    };
    let mut sigmas: Vec<f64> = track.boxes.iter().filter_map(sigmas_above).collect();
    upper_median_by(&mut sigmas, f64::total_cmp).is_some_and(|m| m > drive.hypothesis().hanging_sigmas)
}

/// A box's centre and height \[px\], their standard deviations, and the camera.
struct Sight<'a> {
    ground: &'a GroundFrame,
    /// Position of the camera relative to that of the first box \[m\].
    centre: Vector3<f64>,
    centre_px: [f64; 2],
    height_px: f64,
    /// Of a centre, and of the height \[px\].
    sigma_px: [f64; 2],
}

impl Sight<'_> {
    /// Camera coordinates of a point (homogeneous coordinates, axes of the world, from the first camera), in units of 1/w.
    fn in_camera(&self, point: &Vector4<f64>) -> Vector3<f64> {
        let rotation = self.ground.world_from_camera.rotation_matrix();
        rotation.transpose() * (point.xyz() - self.centre * point.w)
    }
}

/// True when one standing point, with one height that no vehicle has, explains most boxes.
fn stands_far<V: Fn(&Track) -> ExternalTrack>(drive: &Drive<'_, V>, track: &Track) -> bool {
    let box_fit = &drive.options.advanced.box_fit;
    let centre = |b: &TrackBox| drive.grounds.get(b.frame).map(|g| g.world_from_camera.translation());
    let Some(origin) = track.boxes.first().and_then(centre) else { return false };
    let sight = |b: &TrackBox| {
        let (bbox, ground) = (b.observed.bbox, drive.grounds.get(b.frame)?);
        let sigma = |edge: usize| edge_sigma_px(&b.observed, edge, box_fit);
        b.observed.edges.iter().all(|measured| *measured).then(|| Sight {
            ground,
            centre: ground.world_from_camera.translation() - origin,
            centre_px: [(bbox.x1 + bbox.x2) / 2.0, (bbox.y1 + bbox.y2) / 2.0],
            height_px: bbox.height(),
            sigma_px: [sigma(0).max(sigma(1)) / 2f64.sqrt(), sigma(1) * 2f64.sqrt()],
        })
    };
    let sights: Vec<Sight<'_>> = track.boxes.iter().filter_map(sight).collect();
    if 2 * sights.len() < track.boxes.len() {
        return false;
    }
    let Some(point) = triangulated(drive, &sights) else { return false };
    // The height of the point's surroundings, in units of w.
    let mut heights: Vec<f64> =
        sights.iter().map(|s| s.height_px * s.in_camera(&point).z / drive.camera.fy).collect();
    let Some(height) = upper_median_by(&mut heights, f64::total_cmp) else { return false };
    let hypothesis = drive.hypothesis();
    let sigmas = hypothesis.background_sigmas;
    let explained = sights.iter().filter(|s| {
        let p = s.in_camera(&point);
        let aside = centre_residual(drive, s, &p) / s.sigma_px[0];
        let taller = (s.height_px - drive.camera.fy * height / p.z) / s.sigma_px[1];
        p.z > 0.0 && aside.abs() < sigmas && taller.abs() < sigmas
    });
    explained.count() as f64 >= hypothesis.background_share * sights.len() as f64
        && height > hypothesis.tallest_m * point.w
}

/// Column's residual of a point in the camera (homogeneous coordinates) \[px\].
fn centre_residual<V>(drive: &Drive<'_, V>, sight: &Sight<'_>, p: &Vector3<f64>) -> f64 {
    drive.camera.fx * p.x / p.z + drive.camera.cx - sight.centre_px[0]
}

/// The standing point of the boxes' centres in homogeneous coordinates, w ≥ 0, by iteratively reweighted linear
/// triangulation (Hartley and Sturm, Triangulation, 1997). `None` when it is behind the camera.
fn triangulated<V: Fn(&Track) -> ExternalTrack>(
    drive: &Drive<'_, V>,
    sights: &[Sight<'_>],
) -> Option<Vector4<f64>> {
    let camera = drive.camera;
    let mut weights = vec![1.0; sights.len()];
    let mut point = Vector4::zeros();
    for _ in 0..drive.hypothesis().background_passes {
        let mut normal = Matrix4::zeros();
        for (sight, weight) in sights.iter().zip(&weights) {
            let rotation = sight.ground.world_from_camera.rotation_matrix();
            let mut add = |in_camera: Vector3<f64>| {
                let in_world = rotation * in_camera;
                let row = in_world.push(-in_world.dot(&sight.centre));
                normal += row * row.transpose() * (weight / sight.sigma_px[0].powi(2));
            };
            add(Vector3::new(camera.fx, 0.0, camera.cx - sight.centre_px[0]));
            add(Vector3::new(0.0, camera.fy, camera.cy - sight.centre_px[1]));
        }
        let eigen = SymmetricEigen::new(normal);
        point = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let ahead: f64 = sights.iter().map(|s| s.in_camera(&point).z.signum()).sum();
        point *= ahead.signum();
        for (sight, weight) in sights.iter().zip(&mut weights) {
            let p = sight.in_camera(&point);
            let scaled = centre_residual(drive, sight, &p) / sight.sigma_px[0];
            *weight = 1.0 / (p.z * p.z).max(f64::MIN_POSITIVE) / (1.0 + scaled * scaled);
        }
    }
    // A point behind the plane at infinity is one at infinity within the errors.
    point.w = point.w.max(0.0);
    (sights.iter().all(|s| s.in_camera(&point).z > 0.0)).then_some(point)
}
