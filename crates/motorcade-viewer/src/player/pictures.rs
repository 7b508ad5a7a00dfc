//! Small pictures of the frames.

use std::io::Cursor;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::thumbnail;
use motorcade::RunResult;
use motorcade_dataset::Frame;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::outlines::outlines;

/// Most pictures of a report: with 30 kB each the page of an hour stays below 25 MB.
const MOST: usize = 250;
/// Most pixels of a picture.
const MOST_PX: f64 = 150_000.0;
const QUALITY: u8 = 60;

/// A frame as a small JPEG.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Picture {
    /// Number of the frame in the input.
    number: u64,
    jpeg: Vec<u8>,
}

/// Makes pictures of the frames of a drive as they pass, evenly spread. It can be kept in a file between two frames.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Pictures {
    every: usize,
    seen: usize,
    taken: Vec<Picture>,
}

impl Pictures {
    /// For a drive of so many frames; 0 where nobody knows: then they are taken more seldom as it gets longer.
    pub fn new(frames: usize) -> Self {
        Self { every: frames.div_ceil(MOST).max(1), seen: 0, taken: Vec::new() }
    }

    /// Takes the next frame; without one where it did not read.
    pub fn push(&mut self, frame: Option<&Frame>) {
        let wanted = self.seen.is_multiple_of(self.every);
        self.seen += 1;
        if let Some(frame) = frame.filter(|_| wanted)
            && let Some(jpeg) = small(frame)
        {
            self.taken.push(Picture { number: frame.number, jpeg });
        }
        if self.taken.len() > MOST {
            let mut index = 0;
            self.taken.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.every *= 2;
        }
    }

    /// The pictures so far, by frame.
    pub fn taken(&self) -> &[Picture] {
        &self.taken
    }
}

/// The frame as a JPEG of at most about [`MOST_PX`].
fn small(frame: &Frame) -> Option<Vec<u8>> {
    let (width, height) = frame.size();
    let scale = (MOST_PX / (f64::from(width) * f64::from(height))).sqrt().min(1.0);
    let side = |length: u32| ((f64::from(length) * scale).round() as u32).max(1);
    let picture = thumbnail(frame.rgb().as_ref(), side(width), side(height));
    let mut jpeg = Cursor::new(Vec::new());
    JpegEncoder::new_with_quality(&mut jpeg, QUALITY).encode_image(&picture).ok()?;
    Some(jpeg.into_inner())
}

/// Rows, pictures and outlines of the vehicles in them.
pub(super) fn pictures(result: &RunResult, pictures: &[Picture]) -> Value {
    let rows: Vec<(usize, &Picture)> = pictures
        .iter()
        .filter_map(|p| Some((result.frames.iter().position(|f| f.number == p.number)?, p)))
        .collect();
    json!({
        "row": rows.iter().map(|(row, _)| row).collect::<Vec<_>>(),
        "jpeg": rows.iter().map(|(_, p)| STANDARD.encode(&p.jpeg)).collect::<Vec<_>>(),
        "outlines": rows.iter().map(|(row, _)| outlines(result, *row)).collect::<Vec<_>>(),
    })
}
