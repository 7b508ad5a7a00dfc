//! A shape prior and options, ready for fitting.

use motorcade_geometry::PinholeCamera;

use super::model::{Model, Shape};
use super::observation::Observation;
use super::options::FitOptions;
use crate::error::FitError;
use crate::prior::ShapePrior;

/// Keypoints needed on a known road: two points give position and size, visibility the heading.
const NEEDED_ON_ROAD: usize = 2;
/// Keypoints needed otherwise: six numbers of a pose and one to spare.
const NEEDED_FREE: usize = 4;

/// Fits vehicles with one prior and one set of options.
#[derive(Clone, Debug)]
pub struct ShapeFitter {
    prior: ShapePrior,
    options: FitOptions,
    pub(super) model: Model,
}

impl ShapeFitter {
    /// Prepares the prior.
    pub fn new(prior: ShapePrior, options: FitOptions) -> Self {
        let model = Model::new(&prior, options.deformations);
        Self { prior, options, model }
    }
    /// The prior.
    pub fn prior(&self) -> &ShapePrior {
        &self.prior
    }
    /// The options.
    pub fn options(&self) -> &FitOptions {
        &self.options
    }

    /// Checks camera, observation and the number of keypoints.
    pub(super) fn check(&self, camera: &PinholeCamera, observation: &Observation) -> Result<(), FitError> {
        camera.validate()?;
        observation.validate()?;
        let expected = self.model.keypoints;
        let found = observation.keypoints.len();
        if found != expected {
            return Err(FitError::KeypointCount { prior: self.prior.name().to_owned(), expected, found });
        }
        let min_confidence = self.options.min_confidence;
        let found = observation.keypoints.iter().filter(|k| k.confidence >= min_confidence).count();
        let needed = if observation.road.is_some() { NEEDED_ON_ROAD } else { NEEDED_FREE };
        if found < needed {
            return Err(FitError::TooFewKeypoints { found, needed, min_confidence });
        }
        Ok(())
    }

    /// Initial shape: the most likely one of the size prior, or the mean.
    pub(super) fn start_shape(&self, observation: &Observation) -> Shape {
        observation
            .size
            .map_or_else(Default::default, |size| self.model.whitened(&self.prior.coefficients_for(&size)))
    }
}
