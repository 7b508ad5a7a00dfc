//! Keyframes as places.

use motorcade_geometry::{Camera, Pose, World};
use nalgebra::{Matrix6, Point3};

use crate::features::Feature;
use crate::hidden::HiddenParts;

/// Features of a keyframe, with positions where they are known.
#[derive(Clone, Debug, Default)]
pub struct PlaceKeyframe {
    /// Frame of the drive.
    pub frame: usize,
    /// Map it belongs to: poses of different maps have nothing to do with each other.
    pub segment: usize,
    /// Features.
    pub features: Vec<Feature>,
    /// Parts from which no features were taken.
    pub hidden: HiddenParts,
}

/// A keyframe with its pose, ready to be searched.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct PlacedKeyframe {
    /// Frame of the drive.
    pub frame: usize,
    /// Map it belongs to.
    pub segment: usize,
    /// Pose \[m\].
    pub world_from_camera: Pose<World, Camera>,
    /// Covariance of the pose (6×6 `[ω, ν]`, right perturbation; rad, m).
    pub covariance: Matrix6<f64>,
    /// Way driven from the beginning of the drive \[m\].
    pub way_m: f64,
    /// Features.
    pub features: Vec<Feature>,
    /// Features with positions.
    pub landmarks: Vec<Landmark>,
    /// Parts from which no features were taken; nothing once it was looked for.
    pub hidden: HiddenParts,
}

impl PlacedKeyframe {
    /// Leaves out what only the search for it needs: later keyframes are matched with landmarks alone.
    pub(crate) fn forget_unplaced(&mut self) {
        let known = |l: &Landmark| Some((*l, *self.features.get(l.feature as usize)?));
        let (landmarks, features): (Vec<Landmark>, Vec<Feature>) =
            self.landmarks.iter().filter_map(known).unzip();
        self.features = features;
        self.landmarks = landmarks;
        self.features.shrink_to_fit();
        self.landmarks.shrink_to_fit();
        self.hidden = HiddenParts::default();
        (0..).zip(&mut self.landmarks).for_each(|(k, landmark)| landmark.feature = k);
    }
}

/// A feature with a position. 20 bytes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Landmark {
    /// Index of the feature.
    pub feature: u32,
    /// Position in the keyframe's camera \[m\].
    pub point_in_camera: [f32; 3],
    /// Standard deviation of its depth along the ray, as a share of the depth.
    pub depth_sigma: f32,
}

impl Landmark {
    /// Position in the keyframe's camera \[m\].
    pub fn point(&self) -> Point3<f64> {
        let [x, y, z] = self.point_in_camera.map(f64::from);
        Point3::new(x, y, z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::Descriptor;

    #[test]
    fn landmarks_keep_their_features() {
        let feature = |k: u64| Feature { descriptor: Descriptor([k; 4]), pixel: [0.0; 2], level: 0, turn: 0 };
        let landmark = |feature| Landmark { feature, point_in_camera: [1.0; 3], depth_sigma: 0.1 };
        let mut keyframe = PlacedKeyframe {
            frame: 0,
            segment: 0,
            world_from_camera: Pose::identity(),
            covariance: Matrix6::zeros(),
            way_m: 0.0,
            features: (0..6).map(feature).collect(),
            // The last one has no feature.
            landmarks: [1, 4, 5, 9].map(landmark).to_vec(),
            hidden: HiddenParts::of((9, 9), |_, _| false),
        };
        keyframe.forget_unplaced();
        let of = |l: &Landmark| keyframe.features[l.feature as usize].descriptor.0[0];
        assert_eq!(keyframe.landmarks.iter().map(of).collect::<Vec<_>>(), [1, 4, 5]);
        assert_eq!((keyframe.features.len(), keyframe.hidden), (3, HiddenParts::default()));
    }
}
