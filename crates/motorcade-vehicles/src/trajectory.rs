//! Trajectory of one vehicle: states, single-frame measurements and size.

use crate::joint_size::{SizeByRoad, scale_variance};
use motorcade_geometry::{Camera, Pose, Vehicle, World};
use motorcade_perception::{BoundingBox, VehicleClass};
use motorcade_shape::Dimensions;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// Source of a state or measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// A box of this frame.
    Box,
    /// Keypoints of this frame, with its box.
    Keypoints,
    /// A pose from a file, with the box when there is one.
    External,
    /// The motion model, between measurements.
    Predicted,
}

/// A vehicle in one frame.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct VehicleState {
    /// Frame (row of the run).
    pub frame: usize,
    /// Pose \[m\].
    pub world_from_vehicle: Pose<World, Vehicle>,
    /// Covariance (6×6 `[ω, ν]`, vehicle frame).
    pub covariance: Matrix6<f64>,
    /// Image box: the detection's, else the projected one \[px\].
    pub bbox: Option<BoundingBox>,
    /// Score of the detection; 0 when predicted.
    pub score: f64,
    /// Speed over the road, forward positive \[m/s\].
    pub speed_mps: f64,
    /// Standard deviation of the speed \[m/s\].
    pub speed_sigma_mps: f64,
    /// Yaw rate, left positive \[rad/s\].
    pub yaw_rate_radps: f64,
    /// Source.
    pub source: Source,
    /// Measurement of this frame, all its sources fused and the size marginalised.
    pub measurement: Option<VehicleMeasurement>,
    /// Measurements of each source of this frame, given the track's size.
    pub observations: Vec<PoseObservation>,
    /// Variance of the heading by what all frames of a standing vehicle share, until it is in the covariance \[rad²\].
    pub heading_variance: f64,
    /// The less probable hypothesis of a vehicle that may stand or move, until it is in the covariance or mixed in.
    pub rival: Option<RivalState>,
}

/// State by the less probable one of two hypotheses, relative to that by the other one.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RivalState {
    /// Its probability.
    pub probability: f64,
    /// Its position, in the vehicle's axes \[m\].
    pub offset_m: Vector3<f64>,
    /// Its heading, left positive \[rad\].
    pub turn_rad: f64,
    /// Its covariance (6×6 `[ω, ν]`): rotation in its own axes, position in those of the vehicle.
    pub covariance: Matrix6<f64>,
    /// Its speed \[m/s\].
    pub speed_mps: f64,
    /// Standard deviation of its speed \[m/s\].
    pub speed_sigma_mps: f64,
    /// Its yaw rate, left positive \[rad/s\].
    pub yaw_rate_radps: f64,
}

impl RivalState {
    /// True when all its numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        let scalars = [self.turn_rad, self.speed_mps, self.speed_sigma_mps, self.yaw_rate_radps];
        let numbers = scalars.iter().chain(&self.offset_m).chain(&self.covariance);
        numbers.into_iter().all(|number| number.is_finite())
    }
}

impl VehicleState {
    /// Takes the variance of the heading and the rival into the covariance: the second moment of both hypotheses about the state, which stays. For a drive
    /// as a whole, which has seen enough to decide, and for vehicles whose last seconds decide.
    pub fn include_hypotheses(&mut self) {
        self.covariance[(2, 2)] += std::mem::take(&mut self.heading_variance);
        let Some(RivalState { probability, offset_m, turn_rad, speed_mps, .. }) = self.rival.take() else {
            return;
        };
        let mut position = self.covariance.fixed_view_mut::<3, 3>(3, 3);
        position += offset_m * offset_m.transpose() * probability;
        self.covariance[(2, 2)] += turn_rad * turn_rad * probability;
        let off_mps = probability.sqrt() * (speed_mps - self.speed_mps);
        self.speed_sigma_mps = self.speed_sigma_mps.hypot(off_mps);
    }

    /// Mixes the rival in: mean and covariance of both hypotheses, x = Σ pᵢ xᵢ, Σ = Σ pᵢ (Σᵢ + (xᵢ − x)(xᵢ − x)ᵀ) (Bar-Shalom et al. 2001, section
    /// 1.4.16). Orientation and measurements stay those of the more probable one. For the last seconds of a drive, which may be wrong yet.
    pub fn mix_rival(&mut self) {
        let Some(rival) = self.rival.take() else { return };
        let share = rival.probability;
        let between = share * (1.0 - share);
        let mean = |own: f64, other: f64| own + share * (other - own);
        let variance = |own: f64, other: f64, off: f64| mean(own, other) + between * off * off;
        let (of_own, of_other): (Matrix3<f64>, Matrix3<f64>) = (
            self.covariance.fixed_view::<3, 3>(3, 3).into_owned(),
            rival.covariance.fixed_view::<3, 3>(3, 3).into_owned(),
        );
        let off = rival.offset_m;
        let mixed = of_own * (1.0 - share) + of_other * share + off * off.transpose() * between;
        self.covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&mixed);
        self.covariance[(2, 2)] = variance(self.covariance[(2, 2)], rival.covariance[(2, 2)], rival.turn_rad);
        let speed_mps = rival.speed_mps - self.speed_mps;
        let (own, other) = (self.speed_sigma_mps.powi(2), rival.speed_sigma_mps.powi(2));
        self.speed_sigma_mps = variance(own, other, speed_mps).sqrt();
        self.speed_mps = mean(self.speed_mps, rival.speed_mps);
        self.yaw_rate_radps = mean(self.yaw_rate_radps, rival.yaw_rate_radps);
        let pose = self.world_from_vehicle;
        let (rotation, place) = (pose.rotation(), pose.translation());
        self.world_from_vehicle = Pose::from_parts(rotation, place + rotation * off * share);
    }
}

/// Measurement of a vehicle's pose in a single frame.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub struct VehicleMeasurement {
    /// Pose in the camera \[m\].
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Covariance (6×6 `[ω, ν]`, vehicle frame).
    pub covariance: Matrix6<f64>,
}

/// Scale that the distance of an observation depends on.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Scaling {
    /// The vehicle's size.
    Size,
    /// A scale of the source, common to the frames of a track: the size that it assumed is unknown.
    Source {
        /// Standard deviation of the scale's logarithm.
        sigma: f64,
    },
}

/// Pose measurement from one source in one frame, conditioned on the scale of the vehicle's size: an error of the scale is
/// common to all frames of a track, the covariance is that of the rest.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub struct PoseObservation {
    /// Box, keypoints or external pose.
    pub source: Source,
    /// Pose in the camera if the vehicle has the track's size \[m\].
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Covariance of the pose with the scale held (6×6 `[ω, ν]`, vehicle frame).
    pub covariance: Matrix6<f64>,
    /// The scale it depends on.
    pub scaling: Scaling,
    /// Derivative of the pose (tangent `[ω, ν]`) by the logarithm of the scale, proportions kept \[rad, m\].
    pub scale_derivative: Vector6<f64>,
    /// Derivative of the pose (tangent `[ω, ν]`) by the error that all boxes and keypoints of a track share, in its standard deviations \[rad, m\]; zero for
    /// external poses.
    pub common_derivative: Vector6<f64>,
}

/// A vehicle with its states.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct VehicleTrajectory {
    /// Identity.
    pub id: usize,
    /// Class.
    pub class: VehicleClass,
    /// Size, one for the whole track.
    pub size: Dimensions,
    /// Covariance of the size (3×3) \[m²\].
    pub size_covariance: Matrix3<f64>,
    /// Its size by the road alone; `None` where the road does not determine it.
    pub size_by_road: Option<SizeByRoad>,
    /// Probability that it moves during the track.
    pub p_moving: f64,
    /// States, one per frame from the first measurement to the last.
    pub states: Vec<VehicleState>,
}

impl VehicleTrajectory {
    /// Variance of the logarithm of the size's scale, proportions kept.
    pub fn scale_variance(&self) -> f64 {
        scale_variance(&self.size, &self.size_covariance)
    }

    /// Multiplies the size by `exp(shift)` and sets the variance of the logarithm of its scale.
    pub fn rescale(&mut self, shift: f64, variance: f64) {
        let d = self.size.to_vector();
        let scale = d * d.transpose();
        let proportions = self.size_covariance - scale * self.scale_variance();
        let factor = shift.exp();
        self.size = Dimensions::from_vector(&(d * factor));
        self.size_covariance = (proportions + scale * variance) * (factor * factor);
    }

    /// Standard deviations of the size.
    pub fn size_sigma(&self) -> Dimensions {
        Dimensions::from_vector(&self.size_covariance.diagonal().map(|v| v.max(0.0).sqrt()))
    }
}
