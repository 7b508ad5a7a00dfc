//! One vehicle's way through the world, and what it is made from.

use crate::joint_size::scale_variance;
use motorcade_geometry::{Camera, Pose, Vehicle, World};
use motorcade_perception::{BoundingBox, VehicleClass};
use motorcade_shape::{Dimensions, SizePrior};
use nalgebra::{Matrix3, Matrix6, Point3, Vector3, Vector6};

/// Which side of the road traffic keeps to; decides only which way a parked vehicle is taken to face, which its box
/// cannot tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrafficSide {
    /// Most of the world.
    #[default]
    Right,
    /// Britain, Japan, India, Australia, southern Africa.
    Left,
}

/// Where a state comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// A box of this frame.
    Box,
    /// Keypoints of this frame, with its box.
    Keypoints,
    /// A pose given for this frame, with its box when there is one.
    External,
    /// The motion model, between boxes.
    Predicted,
}

/// A vehicle in one frame.
#[derive(Clone, Debug)]
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
    /// Where the state comes from.
    pub source: Source,
    /// What this frame alone says, all its sources together, whatever the size may be.
    pub measured: Option<VehicleMeasurement>,
    /// What each source of this frame says if the vehicle has the track's size.
    pub sightings: Vec<Sighting>,
}

/// A single frame's view of a vehicle, before any smoothing.
#[derive(Clone, Copy, Debug)]
pub struct VehicleMeasurement {
    /// Pose in the camera \[m\].
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Covariance (6×6 `[ω, ν]`, vehicle frame).
    pub covariance: Matrix6<f64>,
}

/// What the distances of a sighting scale with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scaling {
    /// The vehicle's size.
    Size,
    /// A factor of the source's own, one for all frames of a track: what it took the vehicle for, we do not know.
    Source {
        /// Standard deviation of the factor's logarithm.
        sigma: f64,
    },
}

/// What one source of one frame says of a vehicle of a known scale, and how that depends on the scale: a wrong scale is common
/// to all frames of a track, what remains is a frame's own.
#[derive(Clone, Copy, Debug)]
pub struct Sighting {
    /// Box, keypoints or given.
    pub source: Source,
    /// Pose in the camera if the vehicle has the track's size \[m\].
    pub camera_from_vehicle: Pose<Camera, Vehicle>,
    /// Covariance of the pose with the scale held (6×6 `[ω, ν]`, vehicle frame).
    pub covariance: Matrix6<f64>,
    /// Which scale that is.
    pub scaling: Scaling,
    /// Derivative of the pose's tangent by the logarithm of the scale, all proportions of a size kept \[rad, m\].
    pub by_scale: Vector6<f64>,
}

/// A vehicle and its way.
#[derive(Clone, Debug)]
pub struct VehicleTrajectory {
    /// Identity.
    pub id: usize,
    /// Class.
    pub class: VehicleClass,
    /// Size, one for the whole track.
    pub size: Dimensions,
    /// Covariance of the size (3×3) \[m²\].
    pub size_covariance: Matrix3<f64>,
    /// Probability that it moves at some time of the track.
    pub p_moving: f64,
    /// States, one a frame from the first box to the last.
    pub states: Vec<VehicleState>,
}

impl VehicleTrajectory {
    /// Variance of the logarithm of the size's scale, all proportions kept.
    pub fn scale_variance(&self) -> f64 {
        scale_variance(&self.size, &self.size_covariance)
    }

    /// The size made larger by a factor whose logarithm is `shift`, now known with this variance of its scale.
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

/// A pose somebody else found in a frame (a shape-prior front end, say), in place of or beside the box.
#[derive(Clone, Copy, Debug)]
pub struct ExternalView {
    /// Frame (row of the run).
    pub frame: usize,
    /// Bottom centre, camera frame \[m\].
    pub position_in_camera: Point3<f64>,
    /// Where the nose points, camera frame, unit.
    pub forward_in_camera: Vector3<f64>,
    /// Covariance of the position (3×3, camera frame) \[m²\].
    pub covariance: Matrix3<f64>,
    /// Standard deviation of the heading \[rad\].
    pub heading_sigma_rad: f64,
    /// How the position depends on the vehicle's size; `None` when that is not known.
    pub by_size: Option<BySize>,
    /// Where it is not: standard deviation of the logarithm of a factor on the distance that all positions of the track have in
    /// common. The covariance has it in it.
    pub scale_sigma: f64,
    /// Whether it was given or comes from keypoints.
    pub source: Source,
}

/// How a place depends on the size it was found with.
#[derive(Clone, Copy, Debug)]
pub struct BySize {
    /// The size the place belongs to.
    pub size: Dimensions,
    /// Derivative of the place by (length, width, height) (3×3, camera frame) \[m/m\].
    pub slope: Matrix3<f64>,
    /// Covariance of the place with the size held (3×3, camera frame) \[m²\].
    pub covariance: Matrix3<f64>,
}

/// All that others found of a vehicle.
#[derive(Clone, Debug, Default)]
pub struct ExternalTrack {
    /// Poses, in order of frames.
    pub views: Vec<ExternalView>,
    /// What they say of the size, all together, in place of what is known of its class.
    pub size: Option<SizePrior>,
}
