//! Fits to one image.

use motorcade_geometry::PinholeCamera;

use super::fitter::ShapeFitter;
use super::observation::Observation;
use super::result::ShapeFit;
use super::search::Search;
use super::track_shape::TrackShape;
use crate::error::FitError;

impl ShapeFitter {
    /// Pose and shape of one vehicle from one image (equations 6–8 of the paper).
    ///
    /// Headings over the circle, with left and right as given and exchanged, are positioned linearly; the most likely ones are
    /// refined in pose and shape. Deterministic.
    pub fn fit(&self, camera: &PinholeCamera, observation: &Observation) -> Result<ShapeFit, FitError> {
        let search = Search { fitter: self, camera, observation, known: None };
        search.run(&self.start_shape(observation))
    }

    /// As [`ShapeFitter::fit`] with the shape of the vehicle's track: the pose is estimated with the shape held (equation 7),
    /// and the covariance of the shape is propagated.
    pub fn fit_shaped(
        &self,
        camera: &PinholeCamera,
        observation: &Observation,
        shape: &TrackShape,
    ) -> Result<ShapeFit, FitError> {
        Search { fitter: self, camera, observation, known: Some(shape) }.run(&shape.mean)
    }
}
