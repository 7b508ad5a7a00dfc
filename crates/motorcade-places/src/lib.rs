//! Places seen again: which keyframes of a drive show a place that an earlier one showed, and where the camera stood then.
//!
//! FAST corners with steered binary descriptors are found in keyframes ([`FeatureExtractor`]); neighbouring keyframes give them positions
//! ([`place_keyframes`]). [`find_places`] looks for each keyframe among all that the camera has left: an index by parts of the descriptors
//! gives candidates, the landmarks of a candidate give the pose of the later camera against the earlier one ([`PlaceMatch`], with
//! covariance), and matches that others along the way contradict are dropped.
//!
//! Nothing is trained. Random numbers have fixed seeds: the same keyframes give the same matches. A place seen in the opposite direction
//! is another place.
//!
//! ```
//! use image::{GrayImage, Luma};
//! use motorcade_geometry::{PinholeCamera, Pose};
//! use nalgebra::Matrix6;
//! use motorcade_places::{FeatureExtractor, FramePlacement, PlaceKeyframe, PlaceOptions, find_places, place_keyframes};
//!
//! let camera = PinholeCamera { fx: 300.0, fy: 300.0, cx: 160.0, cy: 80.0, width: 320, height: 160 };
//! let options = PlaceOptions::default();
//! let mut extractor = FeatureExtractor::new(options.features);
//! let image = GrayImage::from_fn(320, 160, |x, y| Luma([((x / 9 * 37 + y / 11 * 91) % 256) as u8]));
//! let keyframe = |frame: usize, features| PlaceKeyframe { frame, features, ..PlaceKeyframe::default() };
//! let keyframes: Vec<_> = (0..3).map(|k| keyframe(k, extractor.extract(&image, |_, _| true))).collect();
//! let placement = |frame: usize| FramePlacement {
//!     world_from_camera: Pose::identity(),
//!     covariance: Matrix6::identity() * 1e-4,
//!     way_m: 50.0 * frame as f64,
//! };
//! let placed = place_keyframes(&camera, keyframes, placement, &options);
//! // A camera that does not move sees no depth, and nothing is joined.
//! let found = find_places(&camera, placed, |_, _, _| true, &options);
//! assert!(found.matches.is_empty() && found.report.queries == 2);
//! ```
//!
//! Modules, lowest first: `features`, `hidden`, `keyframe`, `landmarks`, `placement`, `index`, `by_turn`, `verification`, `sequence`, `finder`, `map`.

mod by_turn;
mod features;
mod finder;
mod hidden;
mod index;
mod keyframe;
mod keyframes;
mod landmarks;
mod map;
mod options;
mod placement;
mod sequence;
mod verification;

pub use features::{Descriptor, Feature, FeatureExtractor};
pub use finder::{FoundPlaces, PlaceSearch, PlaceSearchState, SearchReport, find_places};
pub use hidden::HiddenParts;
pub use keyframe::{Landmark, PlaceKeyframe, PlacedKeyframe};
pub use keyframes::Keyframes;
pub use map::{MapError, MapSummary, PlaceMap};
pub use options::{
    AdvancedPlaceOptions, FeatureOptions, LandmarkOptions, PlaceOptions, SearchOptions, SequenceOptions,
    VerificationOptions,
};
pub use placement::{FramePlacement, place_keyframe, place_keyframes};
pub use verification::PlaceMatch;
