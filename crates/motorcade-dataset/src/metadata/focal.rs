//! A focal length that a file states.

/// Diagonal of 35 mm film \[mm\]: 36 × 24.
const FILM_DIAGONAL_MM: f64 = 43.266_615_305_567_87;
/// Width of 35 mm film \[mm\].
const FILM_WIDTH_MM: f64 = 36.0;
/// Focal lengths that lenses of cameras for driving have \[picture widths\]: 150° to 10° across.
const WIDTHS: std::ops::RangeInclusive<f64> = 0.13..=5.7;

/// Kind of the statement, from which follows how far it is to be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FocalKind {
    /// EXIF `FocalLengthIn35mmFilm`.
    ExifFilm,
    /// EXIF `FocalLength` over the pixel pitch that `FocalPlaneXResolution` gives.
    ExifFocalPlane,
    /// A 35 mm equivalent among the tags of a video.
    ContainerFilm,
}

impl std::fmt::Display for FocalKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::ExifFilm => "EXIF FocalLengthIn35mmFilm",
            Self::ExifFocalPlane => "EXIF FocalLength and FocalPlaneXResolution",
            Self::ContainerFilm => "the video's tag focal_length.35mm_equivalent",
        })
    }
}

/// A focal length that a file states of its pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FocalMetadata {
    /// Focal length \[picture widths\].
    pub widths: f64,
    /// Standard deviation of its logarithm by rounding and by what the statement leaves open. The trust in the kind of statement comes on top.
    pub log_sigma: f64,
    /// Kind of the statement.
    pub kind: FocalKind,
    /// The number in the file \[mm\].
    pub stated_mm: f64,
}

impl FocalMetadata {
    /// By the focal length `film_mm` that gives the same view on 35 mm film, for pictures of `size` px. CIPA DCG-001 compares diagonals, some
    /// makers widths: the mean of both, and half of their distance as a standard deviation beside the rounding to whole millimetres.
    pub(crate) fn of_film(film_mm: f64, (width, height): (u32, u32), kind: FocalKind) -> Option<Self> {
        if film_mm.is_nan() || film_mm <= 0.0 {
            return None;
        }
        let (width, height) = (f64::from(width), f64::from(height));
        let by_diagonal = film_mm / FILM_DIAGONAL_MM * width.hypot(height) / width;
        let by_width = film_mm / FILM_WIDTH_MM;
        let open = 0.5 * (by_diagonal / by_width).ln().abs();
        Self {
            widths: (by_diagonal * by_width).sqrt(),
            log_sigma: open.hypot(rounding(film_mm, 1.0)),
            kind,
            stated_mm: film_mm,
        }
        .possible()
    }

    /// By a focal length \[mm\] that is given to `step_mm`, over a sensor of `sensor_mm` across.
    pub(crate) fn of_sensor(focal_mm: f64, step_mm: f64, sensor_mm: f64) -> Option<Self> {
        Self {
            widths: focal_mm / sensor_mm,
            log_sigma: rounding(focal_mm, step_mm),
            kind: FocalKind::ExifFocalPlane,
            stated_mm: focal_mm,
        }
        .possible()
    }

    fn possible(self) -> Option<Self> {
        (WIDTHS.contains(&self.widths) && self.log_sigma.is_finite()).then_some(self)
    }

    /// Horizontal field of view \[rad\].
    pub fn view_rad(&self) -> f64 {
        2.0 * (0.5 / self.widths).atan()
    }
}

impl std::fmt::Display for FocalMetadata {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({} mm)", self.kind, self.stated_mm)
    }
}

/// Standard deviation of the logarithm of a length that is rounded to a step.
fn rounding(length: f64, step: f64) -> f64 {
    step / 12_f64.sqrt() / length
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn film_equivalents_agree_on_the_shape_of_film_only() {
        let of = |size| FocalMetadata::of_film(28.0, size, FocalKind::ExifFilm).unwrap();
        let film = of((3000, 2000));
        assert!((film.widths - 28.0 / 36.0).abs() < 1e-9, "{film:?}");
        assert!((film.log_sigma - 1.0 / 12_f64.sqrt() / 28.0).abs() < 1e-9, "{film:?}");
        // 28 mm are 65.5° across on film.
        assert!((film.view_rad().to_degrees() - 65.47).abs() < 0.01, "{film:?}");
        let wide = of((1920, 1080));
        assert!(wide.log_sigma > 0.02 && wide.log_sigma < 0.03 && wide.widths < film.widths, "{wide:?}");
    }

    #[test]
    fn lengths_of_no_camera_are_none() {
        for film_mm in [0.0, -24.0, 1.0, 2000.0, f64::NAN, f64::INFINITY] {
            assert_eq!(FocalMetadata::of_film(film_mm, (1920, 1080), FocalKind::ExifFilm), None, "{film_mm}");
        }
        assert_eq!(FocalMetadata::of_sensor(4.2, 0.01, 0.0), None);
        assert!(FocalMetadata::of_sensor(4.2, 0.01, 5.6).is_some());
    }
}
