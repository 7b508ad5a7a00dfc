//! Height of the road ahead, over the plane of a frame, by the camera's own way over it.
//!
//! The plane of a frame is what the road is near the camera: its pitch errs, and roads bend up and down. Where the camera drives over the road later on, its height is known
//! far better than by that plane. Along the way the road is height, slope and curvature, the last a process that forgets itself (Ornstein and Uhlenbeck) with the
//! spread that hills (`hilliness.rs`) have; the places of the later cameras measure the height. A Kalman filter and smoother (Rauch, Tung and Striebel, 1965) give height and standard
//! deviation at each distance.

use nalgebra::{Matrix3, RowVector3, Vector3};

use crate::ground::GroundFrame;
use crate::hilliness::measure_slope_changes;
use crate::options::BoxFitOptions;
use crate::road_ahead::{PLACES, RoadAhead, STEP_M};

/// Way between the later cameras that count \[m\].
const WAY_STEP_M: f64 = 2.0;
/// Sideways over ahead beyond which a later camera is on another road than the one ahead.
const ASIDE: f64 = 0.5;

/// Sets [`GroundFrame::slope_change_sigma_rad`] and [`GroundFrame::road_ahead`] of all frames of a drive, or of a window of it. For the trajectory of visual
/// odometry, whose heights are good to centimetres over the next 80 m: those of satellites and inertial sensors wander by decimetres, and a level road then
/// has hills.
pub fn measure_road_ahead(grounds: &mut [GroundFrame], options: &BoxFitOptions) {
    measure_slope_changes(grounds, options);
    let way = Way::of(grounds);
    let roads: Vec<RoadAhead> = grounds
        .iter()
        .enumerate()
        .map(|(k, ground)| Profile::new(ground, options).smoothed(&way.heights(k, grounds, options)))
        .collect();
    for (ground, road) in grounds.iter_mut().zip(roads) {
        ground.road_ahead = Some(road);
    }
}

/// Frames some way apart.
struct Way {
    frames: Vec<usize>,
}

impl Way {
    fn of(grounds: &[GroundFrame]) -> Self {
        let mut frames: Vec<usize> = Vec::new();
        for (k, ground) in grounds.iter().enumerate() {
            let place = ground.world_from_camera.translation();
            let apart_m = |last: &usize| (place - grounds[*last].world_from_camera.translation()).norm();
            if frames.last().is_none_or(|last| apart_m(last) >= WAY_STEP_M) {
                frames.push(k);
            }
        }
        Self { frames }
    }

    /// Height of the road under the later cameras over the plane of frame `k`, at each place that they reach, and its variance \[m, m²\].
    fn heights(
        &self,
        k: usize,
        grounds: &[GroundFrame],
        options: &BoxFitOptions,
    ) -> [Option<[f64; 2]>; PLACES] {
        let ground = &grounds[k];
        let camera_from_world = ground.world_from_camera.inverse();
        let mut found = [None; PLACES];
        let mut before = [0.0; 3];
        let mut next = 0;
        let later = self.frames.partition_point(|frame| *frame <= k);
        for frame in &self.frames[later..] {
            let later = &grounds[*frame];
            let centre = later.world_from_camera.translation().into();
            let place = camera_from_world.transform_point(&centre).coords;
            let (ahead_m, left_m) = (place.dot(&ground.ahead()), place.dot(&ground.left()));
            // A camera's height over the road is that over the plane under itself.
            let here = [ahead_m, left_m, place.dot(&ground.up) + ground.height_m - later.height_m];
            if left_m.abs() > ASIDE * ahead_m || ahead_m <= before[0] {
                break;
            }
            while next < PLACES && STEP_M * (next + 1) as f64 <= ahead_m {
                let at_m = STEP_M * (next + 1) as f64;
                let share = (at_m - before[0]) / (ahead_m - before[0]);
                let between = |axis: usize| before[axis] + share * (here[axis] - before[axis]);
                let sigma_m = options
                    .way_height_sigma_m
                    .hypot(options.way_slope_sigma_rad * at_m)
                    .hypot(options.way_scale_sigma * between(2))
                    .hypot(options.level_sigma_m(between(1)));
                found[next] = Some([between(2), sigma_m * sigma_m]);
                next += 1;
            }
            if next == PLACES {
                break;
            }
            before = here;
        }
        found
    }
}

/// Height, slope and curvature along the way, with the process between two places.
struct Profile {
    covariance: Matrix3<f64>,
    transition: Matrix3<f64>,
    noise: Matrix3<f64>,
    /// Unevenness, which each place has of its own \[m²\].
    rough: f64,
    gate_sigmas: f64,
}

impl Profile {
    fn new(ground: &GroundFrame, options: &BoxFitOptions) -> Self {
        let change_rad = options.road_slope_sigma_rad.hypot(ground.slope_change_sigma_rad);
        // A change of slope over a length leaves the plane as twice that curvature: by its middle.
        let curvature_sigma = 2.0 * change_rad / options.road_slope_length_m;
        let forgotten = (-STEP_M / options.road_curvature_length_m).exp();
        let rough = options.road_height_sigma_m.powi(2);
        let initial = Vector3::new(rough, ground.pitch_sigma_rad.powi(2), curvature_sigma.powi(2));
        let transition =
            Matrix3::new(1.0, STEP_M, 0.5 * STEP_M * STEP_M, 0.0, 1.0, STEP_M, 0.0, 0.0, forgotten);
        let mut noise = Matrix3::zeros();
        noise[(2, 2)] = (1.0 - forgotten * forgotten) * curvature_sigma.powi(2);
        Self {
            covariance: Matrix3::from_diagonal(&initial),
            transition,
            noise,
            rough,
            gate_sigmas: options.way_gate_sigmas,
        }
    }

    fn smoothed(&self, measured: &[Option<[f64; 2]>; PLACES]) -> RoadAhead {
        let height = RowVector3::new(1.0, 0.0, 0.0);
        let (mut x, mut p) = (Vector3::zeros(), self.covariance);
        let (mut predicted, mut filtered) = (Vec::with_capacity(PLACES), Vec::with_capacity(PLACES));
        let mut follows = true;
        for measurement in measured {
            x = self.transition * x;
            p = self.transition * p * self.transition.transpose() + self.noise;
            predicted.push((x, p));
            if let Some([above_m, variance]) = measurement.filter(|_| follows) {
                let s = p[(0, 0)] + variance;
                let innovation = above_m - x[0];
                // A jump of the trajectory, a bridge over it or a tunnel below: another road from there on.
                follows = innovation * innovation <= self.gate_sigmas.powi(2) * s;
                if follows {
                    let gain = p * height.transpose() / s;
                    x += gain * innovation;
                    p -= gain * (height * p);
                }
            }
            filtered.push((x, p));
        }
        let mut road = RoadAhead { rise_m: [0.0; PLACES], sigma_m: [0.0; PLACES] };
        let (mut mean, mut covariance) = (x, p);
        for k in (0..PLACES).rev() {
            if k + 1 < PLACES {
                let (x, p) = filtered[k];
                let (next_x, next_p) = predicted[k + 1];
                // Positive definite by the noise of the curvature, unless a road has none: then the filter's estimate stays.
                let gain = next_p
                    .try_inverse()
                    .map_or_else(Matrix3::zeros, |inverse| p * self.transition.transpose() * inverse);
                mean = x + gain * (mean - next_x);
                covariance = p + gain * (covariance - next_p) * gain.transpose();
            }
            road.rise_m[k] = mean[0];
            road.sigma_m[k] = (covariance[(0, 0)].max(0.0) + self.rough).sqrt();
        }
        road
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hilliness::tests::{after_level, drive};
    use motorcade_geometry::Pose;
    use nalgebra::{Isometry3, UnitQuaternion};

    fn measured(mut grounds: Vec<GroundFrame>) -> Vec<GroundFrame> {
        measure_road_ahead(&mut grounds, &BoxFitOptions::default());
        grounds
    }

    fn road(ground: &GroundFrame) -> RoadAhead {
        ground.road_ahead.unwrap()
    }

    #[test]
    fn a_crest_is_seen_by_the_way_over_it() {
        // 40 m of level road, then a radius of 200 m; half a metre a frame.
        let grounds = measured(after_level(80, -1.0 / 200.0, 300));
        let fallen_m = |way_m: f64| -0.5 * (way_m - 40.0_f64).max(0.0).powi(2) / 200.0;
        for ahead_m in [10.0, 30.0, 45.0, 60.0] {
            let (rise_m, slope) = road(&grounds[0]).rise(ahead_m);
            assert!((rise_m - fallen_m(ahead_m)).abs() < 0.06, "{ahead_m}: {rise_m}");
            let around = [ahead_m - 1.0, ahead_m + 1.0].map(|d| road(&grounds[0]).rise(d).0);
            assert!((slope - 0.5 * (around[1] - around[0])).abs() < 0.02, "{ahead_m}: {slope}");
            assert!(road(&grounds[0]).sigma_m(ahead_m) < 0.12);
        }
    }

    #[test]
    fn the_way_corrects_the_pitch_of_a_plane() {
        let mut grounds = drive(0.0, 200);
        let tilt_rad = 0.004;
        for ground in &mut grounds {
            ground.up = UnitQuaternion::from_euler_angles(tilt_rad, 0.0, 0.0) * ground.up;
            ground.pitch_sigma_rad = 0.004;
        }
        let grounds = measured(grounds);
        let place = |ahead_m: f64| {
            let above_m = road(&grounds[0]).rise(ahead_m).0;
            grounds[0].point(ahead_m, 0.0, above_m).y
        };
        for ahead_m in [10.0, 30.0, 60.0] {
            assert!((place(ahead_m) - 1.65).abs() < 0.02, "{ahead_m}: {}", place(ahead_m));
            assert!(road(&grounds[0]).sigma_m(ahead_m) < 0.3 * tilt_rad.hypot(1e-3) * ahead_m.max(20.0));
        }
    }

    /// At the end of a drive nothing is known but the plane, as uncertain as without this.
    #[test]
    fn without_a_way_ahead_the_road_is_the_plane() {
        let grounds = measured(drive(0.0, 100));
        let (last, options) = (grounds[99], BoxFitOptions::default());
        for ahead_m in [10.0, 20.0, 40.0] {
            assert_eq!(road(&last).rise(ahead_m).0, 0.0);
            let plane_m =
                crate::box_fit::road_height_sigma_m(&last.without_road_ahead(), ahead_m, 0.0, &options);
            let ratio = road(&last).sigma_m(ahead_m) / plane_m;
            assert!((0.7..1.5).contains(&ratio), "{ahead_m}: {ratio}");
        }
    }

    #[test]
    fn a_jump_of_the_trajectory_is_not_followed() {
        let mut grounds = drive(0.0, 200);
        for ground in &mut grounds[40..] {
            let up = Isometry3::translation(0.0, -8.0, 0.0);
            ground.world_from_camera = Pose::new(up * ground.world_from_camera.isometry());
        }
        let grounds = measured(grounds);
        assert!(road(&grounds[0]).rise(60.0).0.abs() < 0.1);
        assert!(road(&grounds[0]).sigma_m(60.0) > road(&grounds[60]).sigma_m(60.0));
    }

    #[test]
    fn a_camera_that_stands_or_turns_back_has_no_way_ahead() {
        let mut grounds = drive(0.0, 60);
        for ground in &mut grounds {
            ground.world_from_camera = Pose::identity();
        }
        assert!(measured(grounds).iter().all(|ground| road(ground).rise(30.0).0 == 0.0));
        let mut back = drive(0.0, 60);
        back.reverse();
        assert!(measured(back).iter().all(|ground| road(ground).rise(30.0).0 == 0.0));
    }
}
