//! Pictures between NumPy and the pipeline.

use image::{GrayImage, RgbImage};
use motorcade_dataset::{Frame, Pixels};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::errors::Failure;

/// A frame of an array of shape [h, w] or [h, w, 3] of bytes, copied once.
///
/// # Errors
/// Another type or shape.
pub fn frame(image: &Bound<'_, PyAny>, time_ns: i64) -> Result<Frame, Failure> {
    let wrong = |found: String| {
        Failure::input(format!("image: expected an array of shape [h, w] or [h, w, 3] of uint8, got {found}"))
    };
    let Ok(array) = image.cast::<PyArrayDyn<u8>>() else {
        let kind = |name| image.getattr(name).map(|found| found.to_string());
        return Err(wrong(match (kind("dtype"), kind("shape")) {
            (Ok(dtype), Ok(shape)) => format!("{dtype} of shape {shape}"),
            _ => image.get_type().name()?.to_string(),
        }));
    };
    let shape = array.shape().to_vec();
    let held = array.try_readonly().map_err(|_| wrong("one that is being written to".to_owned()))?;
    // One copy: in the order of memory where that is the order of pixels (`as_slice` alone takes columns for rows), else pixel by
    // pixel.
    let bytes = match held.as_slice().ok().filter(|_| array.is_c_contiguous()) {
        Some(bytes) => bytes.to_vec(),
        None => held.as_array().iter().copied().collect(),
    };
    let side = |length: usize| u32::try_from(length).ok();
    match shape.as_slice() {
        [h, w] => {
            let image = side(*w).zip(side(*h)).and_then(|(w, h)| GrayImage::from_raw(w, h, bytes));
            image.map(|image| Frame::from_gray(image, time_ns)).ok_or_else(|| wrong(format!("{shape:?}")))
        }
        [h, w, 3] => {
            let image = side(*w).zip(side(*h)).and_then(|(w, h)| RgbImage::from_raw(w, h, bytes));
            image.map(|image| Frame::from_rgb(image, time_ns)).ok_or_else(|| wrong(format!("{shape:?}")))
        }
        _ => Err(wrong(format!("shape {shape:?}"))),
    }
}

/// A mask of the frame's size: an array of shape [h, w] of bytes, not zero where pixels are to be ignored.
///
/// # Errors
/// Another type or shape.
pub fn mask(image: &Bound<'_, PyAny>, frame: &Frame) -> Result<GrayImage, Failure> {
    let read = self::frame(image, 0)?;
    match read.pixels {
        Pixels::Gray(mask) if mask.dimensions() == frame.size() => Ok(mask),
        pixels => {
            let ((w, h), (width, height)) = (pixels.size(), frame.size());
            Err(Failure::input(format!("ignore: expected one channel of {width}×{height} px, got {w}×{h}")))
        }
    }
}

/// The pixels of a frame as an array of shape [h, w] or [h, w, 3].
pub fn array<'py>(py: Python<'py>, pixels: &Pixels) -> PyResult<Bound<'py, PyAny>> {
    let (w, h) = pixels.size();
    let (w, h) = (w as usize, h as usize);
    Ok(match pixels {
        Pixels::Gray(image) => PyArray1::from_slice(py, image.as_raw()).reshape([h, w])?.into_any(),
        Pixels::Rgb(image) => PyArray1::from_slice(py, image.as_raw()).reshape([h, w, 3])?.into_any(),
    })
}
