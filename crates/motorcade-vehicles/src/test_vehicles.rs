//! Vehicles for tests.

use std::ops::Range;

use motorcade_geometry::{BoundingBox, PinholeCamera, Pose};
use motorcade_perception::{BoxConvention, VehicleClass};
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

use crate::ground::GroundFrame;
use crate::observed_box::ObservedBox;
use crate::outline::image_box;
use crate::size_prior::size_prior;
use crate::track::{Track, TrackBox};
use crate::trajectory::{Source, VehicleState, VehicleTrajectory};

/// A camera 1.5 m above the road.
pub(crate) const CAMERA: PinholeCamera =
    PinholeCamera { fx: 700.0, fy: 700.0, cx: 600.0, cy: 180.0, width: 1200, height: 370 };

/// Frames of a camera that stands on a level road, ten a second.
pub(crate) fn level_grounds(frames: u32) -> Vec<GroundFrame> {
    let ground = |k: u32| GroundFrame {
        world_from_camera: Pose::identity(),
        up: -Vector3::y(),
        height_m: 1.5,
        pitch_sigma_rad: 0.002,
        slope_change_sigma_rad: 0.0,
        road_ahead: None,
        time_s: 0.1 * f64::from(k),
    };
    (0..frames).map(ground).collect()
}

/// A car seen from behind at this place on that road \[m\], with the box it has there, in ten frames.
pub(crate) fn car_ahead(id: usize, x_m: f64, z_m: f64) -> VehicleTrajectory {
    let axes = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
    let (rotation, position) = (UnitQuaternion::from_matrix(&axes), Vector3::new(x_m, 1.5, z_m));
    let mut car = standing_car(id, 0..10, [0.0; 2]);
    let bbox = image_box(
        &CAMERA,
        &Pose::from_parts(rotation, position),
        car.class,
        BoxConvention::VisibleExtent,
        &car.size,
    );
    for state in &mut car.states {
        (state.world_from_vehicle, state.bbox) = (Pose::from_parts(rotation, position), bbox);
    }
    car
}

/// The track that a vehicle was made from, its boxes with these measured edges.
pub(crate) fn track_of(vehicle: &VehicleTrajectory, edges: [bool; 4]) -> Track {
    let observed = |bbox| ObservedBox {
        bbox,
        class: vehicle.class,
        convention: BoxConvention::VisibleExtent,
        edges,
        pixel_size: 1.0,
        road_below: None,
    };
    let one =
        |s: &VehicleState| Some(TrackBox { frame: s.frame, observed: observed(s.bbox?), score: s.score });
    Track::new(vehicle.id, vehicle.class, vehicle.states.iter().filter_map(one).collect())
}

/// The track of a car that drives away from the camera at 8 m/s, seen in these frames, `x_m` aside; of each box the left `share`.
pub(crate) fn seen_driving(
    id: usize,
    frames: impl IntoIterator<Item = usize>,
    x_m: f64,
    share: f64,
) -> Track {
    let mut car = car_ahead(id, x_m, 8.0);
    let (model, first) = (car.states[0].clone(), car.states[0].world_from_vehicle);
    car.states = frames.into_iter().map(|frame| VehicleState { frame, ..model.clone() }).collect();
    for state in &mut car.states {
        let ahead = Vector3::new(0.0, 0.0, 0.8 * state.frame as f64);
        state.world_from_vehicle = Pose::from_parts(first.rotation(), first.translation() + ahead);
        let from_camera = level_grounds(1)[0].world_from_camera.inverse() * state.world_from_vehicle;
        let bbox = image_box(&CAMERA, &from_camera, car.class, BoxConvention::VisibleExtent, &car.size);
        state.bbox = bbox.map(|mut bbox| {
            bbox.x2 = bbox.x1 + share * bbox.width();
            bbox
        });
    }
    track_of(&car, [true; 4])
}

/// A car that stands along x, one state in each of these frames: measured with a score of 1, without a box.
pub(crate) fn standing_car(id: usize, frames: Range<usize>, at: [f64; 2]) -> VehicleTrajectory {
    let state = |frame| VehicleState {
        frame,
        world_from_vehicle: Pose::exp(&Vector6::new(0.0, 0.0, 0.0, at[0], at[1], 0.0)),
        covariance: Matrix6::identity() * 0.09,
        bbox: None,
        score: 1.0,
        speed_mps: 0.0,
        speed_sigma_mps: 0.1,
        yaw_rate_radps: 0.0,
        source: Source::Box,
        measurement: None,
        observations: Vec::new(),
        heading_variance: 0.0,
        rival: None,
    };
    VehicleTrajectory {
        id,
        class: VehicleClass::Car,
        size: size_prior(VehicleClass::Car).mean,
        size_covariance: Matrix3::identity() * 0.01,
        size_by_road: None,
        p_moving: 0.1,
        states: frames.map(state).collect(),
    }
}

impl VehicleTrajectory {
    /// With this box in every frame [px].
    pub(crate) fn with_box(mut self, bbox: [f64; 4]) -> Self {
        self.states.iter_mut().for_each(|s| s.bbox = Some(BoundingBox::new(bbox)));
        self
    }

    /// With these scores; states are predicted where it is zero.
    pub(crate) fn with_scores(mut self, score: impl Fn(usize) -> f64) -> Self {
        for state in &mut self.states {
            state.score = score(state.frame);
            state.source = if state.score > 0.0 { Source::Box } else { Source::Predicted };
        }
        self
    }
}
