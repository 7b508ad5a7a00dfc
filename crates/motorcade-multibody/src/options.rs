//! Settings of the multi-object graph.

use serde::{Deserialize, Serialize};

use crate::advanced::AdvancedGraphOptions;

/// Influence of vehicles on the camera's trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CameraCoupling {
    /// None: all camera poses are fixed.
    Held,
    /// Steps that odometry and road measured are held whole, which keeps all lengths proportional to the camera's
    /// height; vehicles correct the camera only where odometry broke off. Online the same as `Held`.
    #[default]
    StepsHeld,
    /// Measured steps keep their lengths; vehicles may change directions. Online the same as `Held`.
    LengthsHeld,
    /// Vehicles may change directions and lengths, as in the paper.
    Free,
}

/// Settings of the multi-object graph.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GraphOptions {
    /// False leaves the estimates of the front end as they are.
    pub enabled: bool,
    /// Influence of vehicles on the camera's trajectory.
    pub camera: CameraCoupling,
    /// Camera–camera edges.
    pub camera_camera: bool,
    /// Camera–vehicle edges.
    pub camera_vehicle: bool,
    /// Vehicle–vehicle edges: motion model, or the paper's road-plane differences.
    pub vehicle_vehicle: bool,
    /// The paper's constant weights λ instead of covariances (eq. 15).
    pub constant_weights: bool,
    /// λ of camera–camera edges.
    pub lambda_camera: f64,
    /// λ of the trusted vehicle edges.
    pub lambda_trusted: f64,
    /// λ of the less trusted vehicle edges.
    pub lambda_doubted: f64,
    /// Time for which errors of camera–vehicle edges are correlated \[s\]. Their variances are multiplied by this time over
    /// the interval between frames, at least by 1. Larger values trust single frames less.
    pub correlation_time_s: f64,
    /// Settings that rarely need to change.
    pub advanced: AdvancedGraphOptions,
}

impl Default for GraphOptions {
    fn default() -> Self {
        Self {
            enabled: true,
            camera: CameraCoupling::default(),
            camera_camera: true,
            camera_vehicle: true,
            vehicle_vehicle: true,
            constant_weights: false,
            lambda_camera: 1e4,
            lambda_trusted: 1e2,
            lambda_doubted: 1.0,
            correlation_time_s: 0.4,
            advanced: AdvancedGraphOptions::default(),
        }
    }
}

impl GraphOptions {
    /// Factor on the variances of camera–vehicle edges at an interval between frames: errors of neighbouring frames are
    /// correlated.
    pub(crate) fn inflation(&self, interval_s: f64) -> f64 {
        (self.correlation_time_s / interval_s).max(1.0)
    }

    /// The first setting out of its range, with what it must be; all are usable otherwise.
    pub fn validate(&self) -> Result<(), String> {
        let a = &self.advanced;
        for (name, value) in [
            ("correlation_time_s", self.correlation_time_s),
            ("advanced.kernel_scale", a.kernel_scale),
            ("advanced.reference_interval_s", a.reference_interval_s),
            ("advanced.held_rad", a.held_rad),
            ("advanced.held_m", a.held_m),
            ("advanced.tie_rad", a.tie_rad),
            ("advanced.tie_m", a.tie_m),
            ("advanced.least_scale_sigma", a.least_scale_sigma),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(format!("graph.{name} must be positive"));
            }
        }
        let slip = [a.roll_pitch_slip_rad, a.sideways_slip_m, a.slow_sideways_slip_m, a.vertical_slip_m];
        if a.steady_motion_rad
            .iter()
            .chain(&a.steady_motion_m)
            .chain(&slip)
            .any(|s| !(s.is_finite() && *s > 0.0))
        {
            return Err("graph.advanced: standard deviations of the motion model must be positive".into());
        }
        Ok(())
    }
}
