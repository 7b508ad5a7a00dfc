//! Buffers of one frame, reused for the next: a frame that becomes no keyframe allocates nothing.

use nalgebra::Point2;

use crate::buffer::make_room;
use crate::map::{NearbyDepths, Observation, PoseRefiner};

#[derive(Default)]
pub(super) struct Scratch {
    /// New pixel of every landmark, `None` where lost \[px\].
    pub pixels: Vec<Option<Point2<f64>>>,
    /// Observations of the pose refinement.
    pub observations: Vec<Observation>,
    /// Values of a median or quantile: image motions \[px\], depths.
    pub values: Vec<f64>,
    /// Index of the box that contains each landmark.
    pub owners: Vec<Option<usize>>,
    pub depths: NearbyDepths,
    pub refiner: PoseRefiner,
}

impl Scratch {
    /// Reserves room for the landmarks after a keyframe.
    pub fn make_room(&mut self, landmarks: usize) {
        make_room(&mut self.pixels, landmarks);
        make_room(&mut self.observations, landmarks);
        make_room(&mut self.values, landmarks);
        make_room(&mut self.owners, landmarks);
        self.depths.make_room(landmarks);
        self.refiner.make_room(landmarks);
    }
}
