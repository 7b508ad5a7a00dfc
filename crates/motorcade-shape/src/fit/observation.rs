//! Observation of one vehicle in one image.

use motorcade_geometry::RoadPlane;
use nalgebra::{Point2, Vector2};

use super::heading::HeadingEvidence;
use super::options::AdvancedFitOptions;
use crate::dimensions::SizePrior;
use crate::error::FitError;

/// Standard deviation of the height over a level road that was not measured \[m\]: heave of the body and unevenness, 3 cm for a car. A
/// larger one takes the distance more from the size. No option, as the slope below: a caller that knows more, as the vehicle stage does, sets the
/// fields of its [`MeasuredRoad`].
const LEVEL_HEIGHT_SIGMA_M: f64 = 0.03;
/// Standard deviation of the slope of such a road \[°\]. The pitch of a driving car's camera varies by about 0.25° and the slope of streets by
/// 0.2° over 20 m; 0.5° also covers a camera that is not mounted exactly level. A larger one has the same effect.
const LEVEL_SLOPE_SIGMA_DEG: f64 = 0.5;

/// Output of a keypoint network for one point.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ObservedKeypoint {
    /// Pixel \[px\].
    pub pixel: Point2<f64>,
    /// Confidence, 0 to 1; 0 for a missing point, whose pixel is not read.
    pub confidence: f64,
    /// Standard deviation along x and y at confidence 1 \[px\]; `None` for that of the observation.
    pub sigma_px: Option<Vector2<f64>>,
}

impl ObservedKeypoint {
    /// A point as accurate as the observation says.
    pub fn new(pixel: Point2<f64>, confidence: f64) -> Self {
        Self { pixel, confidence, sigma_px: None }
    }
    /// A point that was not found.
    pub fn missing() -> Self {
        Self::new(Point2::origin(), 0.0)
    }
    /// With its own standard deviation along x and y \[px\].
    #[must_use]
    pub fn with_sigma_px(mut self, sigma_px: Vector2<f64>) -> Self {
        self.sigma_px = Some(sigma_px);
        self
    }
}

/// The road under a vehicle, and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MeasuredRoad {
    /// The road under the camera.
    pub plane: RoadPlane,
    /// Standard deviation of the camera's height above it \[m\].
    pub height_sigma_m: f64,
    /// Standard deviation of the slope of the line from the road under the camera to that under the vehicle \[rad\].
    pub slope_sigma_rad: f64,
}

impl MeasuredRoad {
    /// A level road, not measured.
    pub fn level(height_m: f64) -> Self {
        Self {
            plane: RoadPlane::level(height_m),
            height_sigma_m: LEVEL_HEIGHT_SIGMA_M,
            slope_sigma_rad: LEVEL_SLOPE_SIGMA_DEG.to_radians(),
        }
    }
    /// Standard deviation of the road's height at a distance \[m\].
    pub(crate) fn height_sigma_at(&self, distance_m: f64) -> f64 {
        self.height_sigma_m.hypot(self.slope_sigma_rad * distance_m)
    }
    /// Standard deviation of roll and pitch of a vehicle against the plane \[rad\].
    pub(crate) fn lean_sigma_rad(&self, options: &AdvancedFitOptions) -> f64 {
        self.slope_sigma_rad.hypot(options.lean_sigma_rad)
    }
}

/// One vehicle in one image.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Observation {
    /// The keypoints in the order of the prior.
    pub keypoints: Vec<ObservedKeypoint>,
    /// Standard deviation of a keypoint of confidence 1 along x and y \[px\].
    pub sigma_px: Vector2<f64>,
    /// The road, when it is known.
    pub road: Option<MeasuredRoad>,
    /// The size of the class or track, when it is known.
    pub size: Option<SizePrior>,
    /// The heading by a network, when it is known.
    pub heading: Option<HeadingEvidence>,
}

impl Observation {
    fn with_sigma(keypoints: Vec<ObservedKeypoint>, sigma_px: Vector2<f64>) -> Self {
        Self { keypoints, sigma_px, road: None, size: None, heading: None }
    }

    /// Keypoints of known accuracy, without box, road, size and heading.
    pub fn new(keypoints: Vec<ObservedKeypoint>, sigma_px: f64) -> Self {
        Self::with_sigma(keypoints, Vector2::repeat(sigma_px))
    }

    /// Outputs (x, y, confidence) of a network that looks at the box's content stretched to `crop_px` square:
    /// `pixel_x = x · w / crop + x1`. The sigma is the share `sigma_share` of the box's sides.
    pub fn from_crop(outputs: &[[f64; 3]], edges_px: [f64; 4], crop_px: f64, sigma_share: f64) -> Self {
        let [x1, y1, x2, y2] = edges_px;
        let (w, h) = (x2 - x1, y2 - y1);
        let keypoints = outputs
            .iter()
            .map(|[x, y, confidence]| {
                let pixel = Point2::new(x * w / crop_px + x1, y * h / crop_px + y1);
                ObservedKeypoint::new(pixel, *confidence)
            })
            .collect();
        Self::with_sigma(keypoints, Vector2::new(w, h) * sigma_share)
    }

    /// Checks that numbers are finite and in range.
    pub(crate) fn validate(&self) -> Result<(), FitError> {
        for (i, seen) in self.keypoints.iter().enumerate() {
            let confidence = (0.0..=1.0).contains(&seen.confidence);
            require(confidence, || format!("confidence of keypoint {i}"), "0 to 1", seen.confidence)?;
            if seen.confidence > 0.0 {
                let what = || format!("pixel of keypoint {i}");
                seen.pixel.iter().try_for_each(|v| require(v.is_finite(), what, "a finite number", *v))?;
                let what = || format!("sigma of keypoint {i}");
                let sigma = seen.sigma_px.iter().flat_map(|s| s.iter());
                sigma
                    .copied()
                    .try_for_each(|s| require(s.is_finite() && s > 0.0, what, "a positive number", s))?;
            }
        }
        let positive = |what: &'static str, v: f64| {
            require(v.is_finite() && v > 0.0, || what.to_owned(), "a positive number", v)
        };
        self.sigma_px.iter().try_for_each(|v| positive("keypoint sigma", *v))?;
        if let Some(road) = &self.road {
            let length = road.plane.up.norm();
            let unit = (length - 1.0).abs() < 1e-6;
            require(unit, || "length of the road normal".to_owned(), "1", length)?;
            positive("camera height", road.plane.height_m)?;
            positive("sigma of the camera height", road.height_sigma_m)?;
            positive("sigma of the road's slope", road.slope_sigma_rad)?;
        }
        if let Some(size) = &self.size {
            let numbers = [size.mean.to_vector(), size.sigma.to_vector()];
            numbers.iter().flat_map(|v| v.iter()).try_for_each(|v| positive("size prior", *v))?;
        }
        Ok(())
    }
}

fn require(
    holds: bool,
    what: impl Fn() -> String,
    expected: &'static str,
    found: f64,
) -> Result<(), FitError> {
    if holds { Ok(()) } else { Err(FitError::Value { what: what(), expected: expected.into(), found }) }
}
