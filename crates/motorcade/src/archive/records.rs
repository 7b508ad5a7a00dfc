//! The records of a drive by their fields.

use std::io::{self, Read};

use motorcade_multibody::{LoopEdge, MapEdge};
use motorcade_odometry::{EgoFrame, FrameRecord, FrameStatus, RoadCurvature, RoadMeasurement, RoadState};
use motorcade_perception::{BoundingBox, BoxConvention, Detection, VehicleClass, VehicleKeypoints};
use motorcade_places::{
    Descriptor, Feature, HiddenParts, Landmark, PlaceKeyframe, PlaceMatch, PlacedKeyframe,
};
use motorcade_shape::{HeadingEvidence, Layout, ObservedKeypoint};
use motorcade_vehicles::{Source, VehicleState};

use crate::closed_loop::ClosedLoop;
use crate::kept_map::MapMatch;

use super::stored::{Stored, no_such, stored_enum, stored_struct};

stored_enum!(FrameStatus { Initialising = 0, Tracked = 1, Standstill = 2, Bridged = 3 });
stored_struct!(FrameRecord {
    timestamp_ns,
    status,
    segment,
    keyframe,
    camera_from_keyframe,
    inliers,
    rms_px,
    covariance,
});

stored_struct!(RoadState { log_inverse_height, pitch_rad, roll_rad });
stored_struct!(RoadCurvature { value, variance, cross_covariance, prior_sigma });
stored_struct!(RoadMeasurement {
    frame,
    reference,
    state,
    baseline,
    covariance,
    curvature,
    agreement,
    pixels,
});

stored_struct!(Feature { descriptor, pixel, level, turn });
stored_struct!(HiddenParts { cell_px, columns, cells });
stored_struct!(PlaceKeyframe { frame, segment, features, hidden });
stored_struct!(Landmark { feature, point_in_camera, depth_sigma });
stored_struct!(PlacedKeyframe {
    frame,
    segment,
    world_from_camera,
    covariance,
    way_m,
    features,
    landmarks,
    hidden
});
stored_struct!(PlaceMatch { query, candidate, query_from_candidate, covariance, inliers, share, rms_px });
stored_struct!(LoopEdge { earlier, later, later_from_earlier, covariance });
stored_struct!(ClosedLoop { edge, inliers, share, rms_px, weight, closed });
stored_struct!(MapEdge { frame, world_from_keyframe, keyframe_covariance, camera_from_keyframe, covariance });
stored_struct!(MapMatch { edge, map_frame, inliers, share, rms_px, weight, holds });

stored_enum!(VehicleClass { Car = 0, Van = 1, Truck = 2, Bus = 3, Motorcycle = 4 });
stored_enum!(BoxConvention { VisibleExtent = 0, ProjectedCuboid = 1 });
stored_struct!(BoundingBox { x1, y1, x2, y2 });
stored_struct!(Detection { class, score, bbox, convention, external_id, pixel_size, road_below });

stored_enum!(Layout { Car36 = 0, Car14 = 1 });
stored_struct!(ObservedKeypoint { pixel, confidence, sigma_px });
stored_struct!(VehicleKeypoints { layout, points, bbox, heading, presence });

stored_struct!(EgoFrame {
    world_from_camera,
    status,
    step_measured,
    step_covariance,
    covariance,
    scale,
    scale_sigma,
    scale_sigma_alone,
    scale_correlation,
    scale_bias_sigma,
    scale_measured,
    road_normal,
    road_tilt_covariance,
    inliers,
});

stored_enum!(Source { Box = 0, Keypoints = 1, External = 2, Predicted = 3 });

impl Stored for Descriptor {
    fn write(&self, out: &mut Vec<u8>) {
        self.0.write(out);
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        Stored::read(from).map(Self)
    }
}

impl Stored for HeadingEvidence {
    fn write(&self, out: &mut Vec<u8>) {
        self.bins().len().write(out);
        self.bins().iter().for_each(|bin| bin.write(out));
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        Self::from_probabilities(Vec::read(from)?).ok_or_else(|| no_such("heading"))
    }
}

/// A state without the measurement and the observations that it was estimated from, which no result lists.
impl Stored for VehicleState {
    fn write(&self, out: &mut Vec<u8>) {
        let Self {
            frame,
            world_from_vehicle,
            covariance,
            bbox,
            score,
            speed_mps,
            speed_sigma_mps,
            yaw_rate_radps,
            source,
            measurement: _,
            observations: _,
            // Of whole drives alone, whose states stay in memory.
            rival: _,
            heading_variance: _,
        } = self;
        frame.write(out);
        world_from_vehicle.write(out);
        covariance.write(out);
        bbox.write(out);
        [*score, *speed_mps, *speed_sigma_mps, *yaw_rate_radps].write(out);
        source.write(out);
    }
    fn read(from: &mut impl Read) -> io::Result<Self> {
        let (frame, world_from_vehicle) = Stored::read(from)?;
        let (covariance, bbox) = Stored::read(from)?;
        let [score, speed_mps, speed_sigma_mps, yaw_rate_radps] = Stored::read(from)?;
        Ok(Self {
            frame,
            world_from_vehicle,
            covariance,
            bbox,
            score,
            speed_mps,
            speed_sigma_mps,
            yaw_rate_radps,
            source: Stored::read(from)?,
            measurement: None,
            observations: Vec::new(),
            heading_variance: 0.0,
            rival: None,
        })
    }
}
