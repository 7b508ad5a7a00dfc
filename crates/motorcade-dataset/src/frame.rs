//! Frames.

use std::borrow::Cow;
use std::path::PathBuf;

use image::{GrayImage, RgbImage};
use rayon::prelude::*;

use crate::error::Error;

/// Pixels, grey or colour as in the source.
#[derive(Clone, Debug)]
pub enum Pixels {
    /// One channel.
    Gray(GrayImage),
    /// Red, green, blue.
    Rgb(RgbImage),
}

/// A decoded, undistorted frame.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Row in the run, counted from 0 over the selected frames, unreadable ones included.
    pub index: usize,
    /// The input's own number.
    pub number: u64,
    /// Time \[ns\].
    pub timestamp_ns: i64,
    /// The image.
    pub pixels: Pixels,
    /// Nonzero where pixels are to be ignored; same size as the image.
    pub ignore: Option<GrayImage>,
}

/// An unavailable frame. It keeps its row, so that a pipeline can bridge it.
#[derive(Debug, thiserror::Error)]
#[error("frame {number}: {reason}")]
pub struct BadFrame {
    /// Row in the run.
    pub index: usize,
    /// The input's own number.
    pub number: u64,
    /// Time \[ns\].
    pub timestamp_ns: i64,
    /// The file, when there is one.
    pub path: Option<PathBuf>,
    /// The problem.
    #[source]
    pub reason: Error,
}

impl Pixels {
    /// Width and height \[px\].
    pub fn size(&self) -> (u32, u32) {
        match self {
            Self::Gray(image) => image.dimensions(),
            Self::Rgb(image) => image.dimensions(),
        }
    }
}

impl Frame {
    /// A grey image in memory, taken at a time \[ns\]. Row and number are 0: a caller that numbers frames sets `number`.
    pub fn from_gray(image: GrayImage, timestamp_ns: i64) -> Self {
        Self { index: 0, number: 0, timestamp_ns, pixels: Pixels::Gray(image), ignore: None }
    }
    /// A colour image in memory, otherwise as [`from_gray`](Self::from_gray).
    pub fn from_rgb(image: RgbImage, timestamp_ns: i64) -> Self {
        Self { index: 0, number: 0, timestamp_ns, pixels: Pixels::Rgb(image), ignore: None }
    }
    /// Width and height \[px\].
    pub fn size(&self) -> (u32, u32) {
        self.pixels.size()
    }
    /// The image in grey; without a copy when the source is grey.
    pub fn gray(&self) -> Cow<'_, GrayImage> {
        match &self.pixels {
            Pixels::Gray(image) => Cow::Borrowed(image),
            Pixels::Rgb(image) => Cow::Owned(gray_from_rgb(image)),
        }
    }
    /// The image in colour; without a copy when the source is colour.
    pub fn rgb(&self) -> Cow<'_, RgbImage> {
        match &self.pixels {
            Pixels::Rgb(image) => Cow::Borrowed(image),
            Pixels::Gray(image) => {
                let mut rgb = RgbImage::new(image.width(), image.height());
                for (to, from) in rgb.pixels_mut().zip(image.pixels()) {
                    to.0 = [from.0[0]; 3];
                }
                Cow::Owned(rgb)
            }
        }
    }
}

/// Grey by the weights of ITU-R BT.601 in 15-bit fixed point, rounded as OpenCV does.
pub fn gray_from_rgb(rgb: &RgbImage) -> GrayImage {
    let mut gray = GrayImage::new(rgb.width(), rgb.height());
    let width = rgb.width().max(1) as usize;
    let rows = gray.par_chunks_mut(width).zip(rgb.par_chunks(3 * width));
    rows.for_each(|(to, from)| {
        for (to, p) in to.iter_mut().zip(from.chunks_exact(3)) {
            let sum = 9798 * u32::from(p[0]) + 19235 * u32::from(p[1]) + 3735 * u32::from(p[2]) + 16384;
            *to = (sum >> 15) as u8;
        }
    });
    gray
}
