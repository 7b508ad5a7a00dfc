//! Position of a box in the world, for the association.

use motorcade_geometry::PinholeCamera;
use motorcade_perception::{BoundingBox, Detection};
use nalgebra::{Matrix3, Vector3};

use crate::box_fit::BoxFit;
use crate::ground::GroundFrame;
use crate::observed_box::ObservedBox;
use crate::options::{BoxFitOptions, MotionOptions};
use crate::size_prior::size_prior;

/// A position in the world and its covariance (3×3) \[m, m²\].
pub(super) type WorldPosition = (Vector3<f64>, Matrix3<f64>);

/// Camera and noise models that turn boxes into positions.
pub(super) struct Localizer {
    pub(super) camera: PinholeCamera,
    pub(super) box_fit: BoxFitOptions,
    pub(super) motion: MotionOptions,
    /// Time over which errors of boxes are correlated \[s\].
    pub(super) correlation_time_s: f64,
    /// χ² up to which a heading along the road explains a box.
    pub(super) explained_chi2: f64,
    /// Score against that of another box from which a box hides edges of it.
    pub(super) hiding_score_ratio: f64,
}

impl Localizer {
    /// The box of a detection with its measured edges; `others` are the boxes of the frame. Those that score far less hide nothing: beside a vehicle in
    /// the shade lie many weak boxes that show none.
    pub(super) fn observe(&self, detection: &Detection, others: &[&Detection]) -> ObservedBox {
        let least_score = self.hiding_score_ratio * detection.score;
        let believed: Vec<BoundingBox> =
            others.iter().filter(|other| other.score >= least_score).map(|other| other.bbox).collect();
        ObservedBox::new(detection, &self.camera, &believed, &self.box_fit)
    }

    /// Position of a box with the heading of the road or, where that does not explain it, across the road.
    pub(super) fn position(&self, ground: &GroundFrame, observed: &ObservedBox) -> Option<WorldPosition> {
        let prior = size_prior(observed.class);
        let fit = BoxFit { camera: &self.camera, ground, options: &self.box_fit };
        let along = fit.locate(observed, 0.0, &prior);
        let found = match along {
            Some(view) if view.chi2_with_size(&prior) < self.explained_chi2 => view,
            _ => {
                let across = fit.locate(observed, std::f64::consts::FRAC_PI_2, &prior);
                let both = along.into_iter().chain(across);
                both.min_by(|a, b| a.chi2_with_size(&prior).total_cmp(&b.chi2_with_size(&prior)))?
            }
        };
        let r = ground.world_from_camera.rotation_matrix();
        let position = ground.world_from_camera.transform_point(&found.position_in_camera);
        Some((position.coords, r * found.covariance * r.transpose()))
    }
}
