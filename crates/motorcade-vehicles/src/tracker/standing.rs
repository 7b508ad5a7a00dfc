//! The hypothesis that a tracked vehicle stands, beside the one that it moves.
//!
//! A parked vehicle is predicted where it was. Under the hypothesis of motion errors of its first positions become a velocity, and
//! in a row of parked vehicles its box is then taken for that of the next one.

use nalgebra::{Matrix3, Point3, Vector3};

use super::localizer::WorldPosition;
use super::options::AdvancedTrackerOptions;
use crate::ground::GroundFrame;

/// Position of a vehicle that stands, and how much better or worse that explains its boxes than motion does.
#[derive(Clone, Copy, serde::Serialize, serde::Deserialize)]
pub(super) struct Standing {
    /// In the camera of the frame of the last box \[m\].
    in_camera: Point3<f64>,
    /// In the world (3×3) \[m²\].
    covariance: Matrix3<f64>,
    /// Twice the logarithm of the likelihood ratio of motion against standing.
    motion_evidence: f64,
}

impl Standing {
    pub(super) fn new(in_camera: Point3<f64>, covariance: Matrix3<f64>) -> Self {
        Self { in_camera, covariance, motion_evidence: 0.0 }
    }

    /// Twice the logarithm of the likelihood ratio of motion against standing.
    pub(super) fn motion_evidence(&self) -> f64 {
        self.motion_evidence
    }

    /// Position in the world, the camera of the last box being that of `last`, and its covariance for a frame.
    pub(super) fn predict(
        &self,
        last: &GroundFrame,
        now: &GroundFrame,
        options: &AdvancedTrackerOptions,
    ) -> WorldPosition {
        let place = |ground: &GroundFrame| ground.world_from_camera.translation();
        let way_m = (place(now) - place(last)).norm();
        // Errors of distance that are common to all boxes look like a motion by a share of the camera's.
        let drift = Matrix3::identity() * (options.apparent_motion_share * way_m).powi(2);
        (last.world_from_camera.transform_point(&self.in_camera).coords, self.covariance + drift)
    }

    /// Takes a measured position. `predicted` is that of [`Standing::predict`], `moving` that of the hypothesis of motion.
    pub(super) fn update(
        &mut self,
        now: &GroundFrame,
        predicted: &WorldPosition,
        moving: &WorldPosition,
        (measured, noise): &WorldPosition,
        options: &AdvancedTrackerOptions,
    ) {
        let costs = [predicted, moving].map(|(position, covariance)| {
            cost(&(measured - position), &(covariance + noise), options.explained_chi2)
        });
        if let [Some(standing), Some(moving)] = costs {
            let most = options.most_evidence;
            self.motion_evidence = (self.motion_evidence + standing - moving).clamp(-most, most);
        }
        let (position, covariance) = predicted;
        let Some(inverse) = (covariance + noise).try_inverse() else { return };
        let gain = covariance * inverse;
        let updated = position + gain * (measured - position);
        let covariance = covariance - gain * covariance;
        self.covariance = (covariance + covariance.transpose()) * 0.5;
        self.in_camera = now.world_from_camera.inverse().transform_point(&Point3::from(updated));
    }

    /// Keeps the position while no position was measured.
    pub(super) fn keep(&mut self, now: &GroundFrame, predicted: &WorldPosition) {
        let (position, covariance) = predicted;
        self.covariance = *covariance;
        self.in_camera = now.world_from_camera.inverse().transform_point(&Point3::from(*position));
    }
}

/// Twice the negative logarithm of a Gaussian density, up to a constant; χ² counts up to a limit.
fn cost(innovation: &Vector3<f64>, covariance: &Matrix3<f64>, most_chi2: f64) -> Option<f64> {
    let factor = covariance.cholesky()?;
    let chi2 = innovation.dot(&factor.solve(innovation));
    Some(chi2.min(most_chi2) + factor.determinant().ln())
}
