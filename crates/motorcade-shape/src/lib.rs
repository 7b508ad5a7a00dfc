//! The shape of vehicles: a parametric car of named keypoints, and pose and shape of a vehicle from its 2D keypoints.
//!
//! Implements section 3.4 (equations 6–8) of Nair et al., *Multi-object Monocular SLAM for Dynamic Environments* (IV 2020,
//! arXiv 2002.03528) with a prior of our own: cars drawn from published dimensions, their mean and principal components.
//!
//! Three types to know: a [`ShapePrior`] (our own by [`ShapePrior::of_family`], others from [JSON files](json) or
//! [tables](mod@convert)), an [`Observation`] of one vehicle in one image, and the
//! [`ShapeFitter`] that turns one into a [`ShapeFit`]: pose, covariance, shape, size.
//!
//! Frames: vehicle x forward, y left, z up, origin on the road below the body's centre; camera x right, y down, z forward.
//! Metres, radians, pixels.
//!
//! ```
//! use motorcade_geometry::{PinholeCamera, Pose};
//! use motorcade_shape::fit::{FitOptions, Observation, MeasuredRoad, ObservedKeypoint, ShapeFitter};
//! use motorcade_shape::{BodyType, Layout, ShapePrior, project};
//! use nalgebra::{Matrix3, Vector3};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let camera = PinholeCamera { fx: 720.0, fy: 720.0, cx: 610.0, cy: 175.0, width: 1242, height: 375 };
//! let prior = ShapePrior::of_family(Layout::Car36);
//!
//! // A hatchback 14 m ahead on the left, driving away; the network sees what faces the camera.
//! let away = Matrix3::from_columns(&[Vector3::z(), -Vector3::x(), -Vector3::y()]);
//! let truth = Pose::from_matrix(&away, &Vector3::new(-3.0, 1.65, 14.0));
//! let shape = prior.coefficients_of(BodyType::Hatchback).ok_or("no hatchback")?;
//! let seen = project(&prior, shape, &truth, &camera).into_iter().map(|p| {
//!     ObservedKeypoint::new(p.pixel.unwrap_or_default(), if p.visible { 0.8 } else { 0.0 })
//! });
//!
//! let mut observation = Observation::new(seen.collect(), 2.0);
//! observation.road = Some(MeasuredRoad::level(1.65));
//! let fit = ShapeFitter::new(prior, FitOptions::default()).fit(&camera, &observation)?;
//! assert!((fit.camera_from_vehicle.translation() - truth.translation()).norm() < 0.3);
//! assert!((fit.dimensions.length_m - 4.1).abs() < 0.3 && !fit.heading_is_ambiguous());
//! # Ok(())
//! # }
//! ```

mod blueprint;
mod body_type;
pub mod command;
pub mod convert;
mod dimensions;
mod error;
mod family;
mod family_prior;
pub mod fit;
pub mod json;
mod keypoint;
mod prior;
mod table;
mod template;
mod view;

pub use blueprint::Blueprint;
pub use body_type::BodyType;
pub use convert::{ConvertOptions, Proportions, convert};
pub use dimensions::{Dimensions, SizePrior};
pub use error::{FitError, PriorError};
pub use family::{CarModel, FAMILY};
pub use fit::{
    AdvancedFitOptions, CLEAR_COST, FitOptions, HeadingEvidence, MeasuredRoad, Observation, ObservedKeypoint,
    ShapeFit, ShapeFitter, TrackFit, TrackShape,
};
pub use keypoint::{Keypoint, Layout};
pub use prior::{Body, Deformation, NamedShape, PriorParts, ShapePrior};
pub use view::{ProjectedKeypoint, VISIBLE_COSINE, project};
