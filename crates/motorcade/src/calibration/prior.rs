//! Prior of the focal length, from before the drive.

use motorcade_calibrate::{CalibrateOptions, ViewPrior};
use motorcade_dataset::{FocalKind, FocalMetadata, Sequence};

/// Field of view before the drive, and its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FocalPrior {
    /// The field of view.
    pub view: ViewPrior,
    /// Its origin.
    pub origin: PriorOrigin,
}

/// Origin of a field of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PriorOrigin {
    /// Cameras that are sold for cars.
    Usual,
    /// Stated by the user.
    Stated,
    /// Metadata of the input.
    Metadata(FocalMetadata),
}

impl FocalPrior {
    /// The view that the user states.
    pub fn stated(view: ViewPrior) -> Self {
        Self { view, origin: PriorOrigin::Stated }
    }

    /// By the metadata of the input, or that of usual cameras.
    pub fn of(sequence: &Sequence, options: &CalibrateOptions) -> Self {
        let of_metadata = sequence.focal_metadata().map(|metadata| Self::from_metadata(metadata, options));
        of_metadata.unwrap_or(Self { view: ViewPrior::default(), origin: PriorOrigin::Usual })
    }

    fn from_metadata(metadata: FocalMetadata, options: &CalibrateOptions) -> Self {
        let trust = match metadata.kind {
            FocalKind::ExifFilm => options.advanced.exif_film_sigma,
            FocalKind::ExifFocalPlane => options.advanced.exif_focal_plane_sigma,
            FocalKind::ContainerFilm => options.advanced.container_film_sigma,
        };
        let view = ViewPrior { view_rad: metadata.view_rad(), log_sigma: metadata.log_sigma.hypot(trust) };
        Self { view, origin: PriorOrigin::Metadata(metadata) }
    }

    /// The prior in words, for pictures of a width \[px\]; `None` of usual cameras.
    pub fn describe(&self, width: u32) -> Option<String> {
        let origin = match self.origin {
            PriorOrigin::Usual => return None,
            PriorOrigin::Stated => "as stated".to_owned(),
            PriorOrigin::Metadata(metadata) => format!("by {metadata}"),
        };
        let ViewPrior { view_rad, log_sigma } = self.view;
        let (focal_px, percent) = (self.view.focal_px(width), 100.0 * log_sigma);
        Some(format!(
            "{focal_px:.0} px ± {percent:.0} %, {:.0} degrees across, {origin}",
            view_rad.to_degrees()
        ))
    }
}
