//! EXIF of a picture.

use std::io::Cursor;
use std::path::Path;

use exif::{Exif, In, Reader, Tag, Value};
use image::{ImageDecoder, ImageReader};

use super::focal::{FocalKind, FocalMetadata};
use crate::regular_file;

/// Relative difference of two shapes of a picture from which on it was cropped.
const CROPPED: f64 = 0.01;

/// Focal length by the EXIF of a picture file that has pictures of `size` px; `None` where it is not given, or the picture was cropped after it was taken.
pub(super) fn focal(path: &Path, size: (u32, u32)) -> Option<FocalMetadata> {
    let bytes = regular_file::read(path).ok()?;
    let mut decoder = ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?.into_decoder().ok()?;
    let raw = decoder.exif_metadata().ok()??;
    of(&Reader::new().read_raw(raw).ok()?, size)
}

fn of(exif: &Exif, size: (u32, u32)) -> Option<FocalMetadata> {
    let (width, height) = (f64::from(size.0), f64::from(size.1));
    let taken = number(exif, Tag::PixelXDimension).zip(number(exif, Tag::PixelYDimension));
    let cropped = |(w, h): (f64, f64)| (w / h * height / width).ln().abs() > CROPPED;
    if taken.is_some_and(cropped) {
        return None;
    }
    let film = number(exif, Tag::FocalLengthIn35mmFilm);
    let by_film = film.and_then(|mm| FocalMetadata::of_film(mm, size, FocalKind::ExifFilm));
    by_film.or_else(|| {
        let (focal_mm, step_mm) = focal_length(exif)?;
        // Pixels a unit; without the size of the picture as it was taken they may be those of another size.
        let pixels_per_mm = number(exif, Tag::FocalPlaneXResolution)? / unit_mm(exif)?;
        FocalMetadata::of_sensor(focal_mm, step_mm, taken?.0 / pixels_per_mm)
    })
}

fn number(exif: &Exif, tag: Tag) -> Option<f64> {
    let value = &exif.get_field(tag, In::PRIMARY)?.value;
    let number = match value {
        Value::Rational(values) => values.first()?.to_f64(),
        other => f64::from(other.get_uint(0)?),
    };
    (number.is_finite() && number > 0.0).then_some(number)
}

/// Focal length and the step in which it is given \[mm\]: a fraction's denominator.
fn focal_length(exif: &Exif) -> Option<(f64, f64)> {
    let focal_mm = number(exif, Tag::FocalLength)?;
    let Value::Rational(values) = &exif.get_field(Tag::FocalLength, In::PRIMARY)?.value else { return None };
    Some((focal_mm, 1.0 / f64::from(values.first()?.denom)))
}

/// Length of the unit of `FocalPlaneXResolution` \[mm\]; inches where none is given.
fn unit_mm(exif: &Exif) -> Option<f64> {
    match number(exif, Tag::FocalPlaneResolutionUnit).unwrap_or(2.0) as u32 {
        2 => Some(25.4),
        3 => Some(10.0),
        // Beyond the standard, in use.
        4 => Some(1.0),
        5 => Some(0.001),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A value of an entry.
    enum Entry {
        Short(u16),
        Long(u32),
        Rational(u32, u32),
    }
    use Entry::{Long, Rational, Short};

    /// Little-endian TIFF with these entries in the EXIF directory.
    fn tiff(entries: &[(u16, Entry)]) -> Vec<u8> {
        let mut out = b"II*\0\x08\0\0\0".to_vec();
        // First directory: the place of the EXIF directory alone.
        out.extend(1_u16.to_le_bytes());
        out.extend(0x8769_u16.to_le_bytes());
        out.extend(4_u16.to_le_bytes());
        out.extend(1_u32.to_le_bytes());
        out.extend(26_u32.to_le_bytes());
        out.extend(0_u32.to_le_bytes());
        let data = 26 + 2 + 12 * entries.len() as u32 + 4;
        let mut rationals = Vec::new();
        out.extend((entries.len() as u16).to_le_bytes());
        for (tag, entry) in entries {
            out.extend(tag.to_le_bytes());
            let (kind, value) = match entry {
                Short(value) => (3_u16, u32::from(*value)),
                Long(value) => (4, *value),
                Rational(numerator, denominator) => {
                    let at = data + rationals.len() as u32;
                    rationals.extend(numerator.to_le_bytes());
                    rationals.extend(denominator.to_le_bytes());
                    (5, at)
                }
            };
            out.extend(kind.to_le_bytes());
            out.extend(1_u32.to_le_bytes());
            out.extend(value.to_le_bytes());
        }
        out.extend(0_u32.to_le_bytes());
        out.extend(rationals);
        out
    }

    fn read(entries: &[(u16, Entry)], size: (u32, u32)) -> Option<FocalMetadata> {
        of(&Reader::new().read_raw(tiff(entries)).unwrap(), size)
    }

    const FOCAL_LENGTH: u16 = 0x920a;
    const PIXELS_X: u16 = 0xa002;
    const PIXELS_Y: u16 = 0xa003;
    const PLANE_X: u16 = 0xa20e;
    const PLANE_UNIT: u16 = 0xa210;
    const FILM: u16 = 0xa405;

    #[test]
    fn a_35_mm_equivalent_is_read() {
        let found = read(&[(FILM, Short(24))], (3000, 2000)).unwrap();
        assert_eq!(found.kind, FocalKind::ExifFilm);
        assert!((found.widths - 24.0 / 36.0).abs() < 1e-9, "{found:?}");
        // Zero is "unknown" in the standard.
        assert_eq!(read(&[(FILM, Short(0))], (3000, 2000)), None);
    }

    #[test]
    fn a_focal_length_needs_the_pitch_and_the_size_of_the_picture() {
        // A sensor 22.3 mm wide: 6000 px at 6834 px an inch.
        let full = || {
            vec![
                (FOCAL_LENGTH, Rational(180, 10)),
                (PIXELS_X, Long(6000)),
                (PIXELS_Y, Long(4000)),
                (PLANE_X, Rational(6834, 1)),
                (PLANE_UNIT, Short(2)),
            ]
        };
        // The picture was made smaller since.
        let found = read(&full(), (1500, 1000)).unwrap();
        assert_eq!(found.kind, FocalKind::ExifFocalPlane);
        assert!((found.widths - 18.0 / (6000.0 / 6834.0 * 25.4)).abs() < 1e-9, "{found:?}");
        assert!((found.log_sigma - 0.1 / 12_f64.sqrt() / 18.0).abs() < 1e-9, "{found:?}");
        for missing in [FOCAL_LENGTH, PIXELS_X, PLANE_X] {
            let rest: Vec<_> = full().into_iter().filter(|(tag, _)| *tag != missing).collect();
            assert_eq!(read(&rest, (1500, 1000)), None, "{missing:x}");
        }
    }

    #[test]
    fn cropped_pictures_give_nothing() {
        let entries = || [(FILM, Short(24)), (PIXELS_X, Long(6000)), (PIXELS_Y, Long(4000))];
        assert!(read(&entries(), (1500, 1000)).is_some());
        assert_eq!(read(&entries(), (1500, 844)), None);
    }
}
