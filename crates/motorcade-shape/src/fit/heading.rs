//! Evidence of the heading by a network, beside that of the keypoints.

use motorcade_geometry::{Camera, Pose, Vehicle};
use nalgebra::Vector3;

/// Probabilities of the heading against the viewing ray, in even bins: bin `k` of `n` is centred at `k / n` of a turn, 0 drives
/// straight away from the camera, positive turns left seen from above.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HeadingEvidence {
    bins: Vec<f64>,
}

impl HeadingEvidence {
    /// From weights of the bins, at least 4, not negative; `None` for others or when all are zero.
    pub fn new(mut bins: Vec<f64>) -> Option<Self> {
        let total: f64 = bins.iter().sum();
        let weights = bins.len() >= 4 && bins.iter().all(|b| b.is_finite() && *b >= 0.0);
        let valid = weights && total.is_finite() && total > 0.0;
        if !valid {
            return None;
        }
        bins.iter_mut().for_each(|b| *b /= total);
        Some(Self { bins })
    }

    /// Probabilities of the bins as [`Self::bins`] gave them; `None` where they are not probabilities.
    pub fn from_probabilities(bins: Vec<f64>) -> Option<Self> {
        let total: f64 = bins.iter().sum();
        let valid = bins.len() >= 4 && bins.iter().all(|b| (0.0..=1.0).contains(b));
        (valid && (total - 1.0).abs() < 1e-6).then_some(Self { bins })
    }

    /// Probabilities of the bins.
    pub fn bins(&self) -> &[f64] {
        &self.bins
    }

    /// Certain that the heading is within a quarter turn of that of a pose.
    pub fn half_turn_about(camera_from_vehicle: &Pose<Camera, Vehicle>, up: &Vector3<f64>) -> Self {
        const BINS: usize = 24;
        let centre = heading_rad(camera_from_vehicle, up);
        let weight = |k: usize| {
            let angle = k as f64 / BINS as f64 * std::f64::consts::TAU;
            f64::from(u8::from((angle - centre).cos() > 0.0))
        };
        let bins: Vec<f64> = (0..BINS).map(weight).collect();
        let total: f64 = bins.iter().sum();
        Self { bins: bins.into_iter().map(|b| b / total).collect() }
    }

    /// −2 ln of the probability density of a pose's heading over that of an even distribution. With probability `unrelated`
    /// the network's output says nothing.
    pub(crate) fn cost(
        &self,
        camera_from_vehicle: &Pose<Camera, Vehicle>,
        up: &Vector3<f64>,
        unrelated: f64,
    ) -> f64 {
        let count = self.bins.len();
        let turn = heading_rad(camera_from_vehicle, up) / std::f64::consts::TAU;
        let at = turn.rem_euclid(1.0) * count as f64;
        let (low, share) = (at.floor(), at.fract());
        let bin = |k: f64| self.bins[k as usize % count];
        let probability = (1.0 - share) * bin(low) + share * bin(low + 1.0);
        -2.0 * ((1.0 - unrelated) * probability * count as f64 + unrelated).ln()
    }
}

/// Unit vectors along the road: the direction of a ray, and to its left. A ray straight down has none, the camera's y axis then
/// does.
pub(super) fn frame_of_ray(up: &Vector3<f64>, ray: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let along = |v: Vector3<f64>| (v - up * up.dot(&v)).try_normalize(1e-6);
    let ahead = along(*ray).or_else(|| along(-Vector3::y())).unwrap_or_else(Vector3::x);
    (ahead, up.cross(&ahead))
}

/// Heading of a vehicle against the ray to it \[rad\].
fn heading_rad(camera_from_vehicle: &Pose<Camera, Vehicle>, up: &Vector3<f64>) -> f64 {
    let forward = camera_from_vehicle.transform_vector(&Vector3::x());
    let (ahead, left) = frame_of_ray(up, &camera_from_vehicle.translation());
    forward.dot(&left).atan2(forward.dot(&ahead))
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::fit::problem::pose;

    /// A level vehicle at (x, 1, z) whose heading against the camera's axis is given.
    fn vehicle(heading_rad: f64, x: f64, z: f64) -> Pose<Camera, Vehicle> {
        let (s, c) = heading_rad.sin_cos();
        let forward = Vector3::new(-s, 0.0, c);
        let up = -Vector3::y();
        let rotation = Matrix3::from_columns(&[forward, up.cross(&forward), up]);
        pose(&rotation, &Vector3::new(x, 1.0, z))
    }

    #[test]
    fn headings_are_against_the_viewing_ray() {
        let up = -Vector3::y();
        assert!(heading_rad(&vehicle(0.0, 0.0, 10.0), &up).abs() < 1e-12);
        assert!((heading_rad(&vehicle(0.4, 0.0, 10.0), &up) - 0.4).abs() < 1e-12);
        // Parallel to the axis and 45 degrees to the right: the ray points right, so the vehicle is turned left against it.
        let found = heading_rad(&vehicle(0.0, 10.0, 10.0), &up);
        assert!((found - std::f64::consts::FRAC_PI_4).abs() < 1e-12, "{found}");
    }

    #[test]
    fn the_cost_prefers_likely_headings_and_never_forbids() {
        let mut bins = vec![0.0; 24];
        (bins[0], bins[1]) = (0.6, 0.4);
        let evidence = HeadingEvidence::new(bins).unwrap();
        let up = -Vector3::y();
        let cost = |heading: f64| evidence.cost(&vehicle(heading, 0.0, 10.0), &up, 0.05);
        assert!(cost(0.0) < cost(0.2) && cost(0.2) < cost(0.5));
        assert!((cost(std::f64::consts::PI) + 2.0 * 0.05_f64.ln()).abs() < 1e-9);
        let even = HeadingEvidence::new(vec![1.0; 24]).unwrap();
        assert!(even.cost(&vehicle(1.0, 3.0, 10.0), &up, 0.05).abs() < 1e-9);
    }

    #[test]
    fn a_half_turn_leaves_no_doubt() {
        let up = -Vector3::y();
        let evidence = HeadingEvidence::half_turn_about(&vehicle(0.3, 2.0, 10.0), &up);
        let there = evidence.cost(&vehicle(0.9, 2.0, 10.0), &up, 1e-9);
        let back = evidence.cost(&vehicle(0.3 + std::f64::consts::PI, 2.0, 10.0), &up, 1e-9);
        assert!(there < 0.0 && back > 30.0, "{there} {back}");
    }

    #[test]
    fn weights_that_are_no_distribution_are_refused() {
        assert!(HeadingEvidence::new(vec![0.0; 24]).is_none());
        assert!(HeadingEvidence::new(vec![1.0; 3]).is_none());
        assert!(HeadingEvidence::new(vec![1.0, -1.0, 1.0, 1.0]).is_none());
        assert!(HeadingEvidence::new(vec![f64::NAN; 24]).is_none());
    }
}
