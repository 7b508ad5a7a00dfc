//! All measurements of a drive.

use motorcade_dataset::Label;
use nalgebra::Point3;
use rayon::prelude::*;

use super::keypoints::{self, KeypointMeasurement, KeypointOptions};
use super::landmarks::{self, PointObservation, RoadMatch};
use super::options::MeasureOptions;
use super::{FrameOutlines, detections, labels};
use crate::drive::Drive;
use crate::error::Result;

/// All simulated measurements of a drive, in order of frame and then of identity.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurements {
    /// True positions of the landmarks; the world is the first camera \[m\].
    pub landmarks_in_world: Vec<Point3<f64>>,
    /// Landmarks by frame.
    pub points: Vec<PointObservation>,
    /// Matches of road points between neighbouring frames.
    pub road_matches: Vec<RoadMatch>,
    /// True boxes, positions and sizes of vehicles, in KITTI's conventions.
    pub labels: Vec<Label>,
    /// Boxes of the detector.
    pub detections: Vec<Label>,
    /// Keypoints, both layouts.
    pub keypoints: Vec<KeypointMeasurement>,
}

impl Drive {
    /// Simulates measurements of a drive without rendering it. Vehicles occlude; houses do not. All errors depend on the drive's
    /// seed: the same seed gives the same measurements, for any number of threads.
    ///
    /// # Errors
    /// Invalid options, such as a negative noise.
    pub fn measure(&self, options: &MeasureOptions) -> Result<Measurements> {
        options.validate()?;
        let landmarks = landmarks::place(self, options.landmarks_per_m);
        let frame = |frame: usize| {
            let outlines = FrameOutlines::of(self, frame);
            let views = outlines.views(self.vehicles.len());
            let hidden = |owner: usize, pixel: &nalgebra::Point2<f64>, depth_m: f64| {
                outlines.occludes(pixel, depth_m, Some(owner))
            };
            (
                landmarks::observe(self, frame, &landmarks, &outlines, options),
                landmarks::road(self, frame, &outlines, options),
                labels::of_frame(self, frame, &views),
                detections::of_frame(self, frame, &views),
                keypoints::of_frame(self, frame, &outlines, &options.keypoints, &hidden),
            )
        };
        let frames: Vec<_> = (0..self.len()).into_par_iter().map(frame).collect();
        let world_from_site = self.site_from_camera.first().map(motorcade_geometry::Pose::inverse);
        let in_world = |p: &Point3<f64>| world_from_site.as_ref().map_or(*p, |w| w.transform_point(p));
        let mut all = Measurements {
            landmarks_in_world: landmarks.iter().map(in_world).collect(),
            points: Vec::new(),
            road_matches: Vec::new(),
            labels: Vec::new(),
            detections: Vec::new(),
            keypoints: Vec::new(),
        };
        for (points, road, labels, detections, keypoints) in frames {
            all.points.extend(points);
            all.road_matches.extend(road);
            all.labels.extend(labels);
            all.detections.extend(detections);
            all.keypoints.extend(keypoints);
        }
        Ok(all)
    }

    /// Keypoints of a rendered frame, occluded by nearer depths of its depth map.
    pub fn keypoints_of(
        &self,
        frame: usize,
        picture: &crate::Picture,
        options: &KeypointOptions,
    ) -> Vec<KeypointMeasurement> {
        let outlines = FrameOutlines::of(self, frame);
        let width = outlines.camera.width as usize;
        let hidden = |owner: usize, pixel: &nalgebra::Point2<f64>, depth_m: f64| {
            let (x, y) = (pixel.x.round().max(0.0) as usize, pixel.y.round().max(0.0) as usize);
            let before = picture.depth_m.get(y * width + x.min(width - 1)).copied().unwrap_or(f32::INFINITY);
            let shown = picture.instance.as_raw().get(y * width + x.min(width - 1)).copied().unwrap_or(0);
            // The rounded body may lie in front of its own keypoints.
            usize::from(shown) != owner + 1 && f64::from(before) < depth_m - 0.3
        };
        keypoints::of_frame(self, frame, &outlines, options, &hidden)
    }
}
