//! All frames of a drive, drawn on several threads and written in order.

use std::path::{Path, PathBuf};

use anyhow::Context;
use image::{Rgb, RgbImage};
use motorcade::{Progress, RecordedRun};
use motorcade_dataset::{FrameResult, Sequence};
use motorcade_draw::Overlay;
use rayon::prelude::*;

use super::recording;
use super::scenes::Scenes;
use super::target::{Put, Target, encode, write_pictures, write_video};
use crate::exit::Stopped;
use crate::progress::Reporter;

/// Frames in memory per thread.
const FRAMES_A_THREAD: usize = 2;
/// Stands for a frame that does not read.
const GREY: Rgb<u8> = Rgb([60; 3]);

/// A drive to be drawn.
pub struct Drawing<'a> {
    sequence: &'a Sequence,
    scenes: Scenes,
    overlay: Overlay,
    threads: usize,
    /// Directory of the run.
    directory: &'a Path,
}

/// A finished drawing.
pub struct Drawn {
    pub frames: usize,
    /// The video, the folder of pictures or the recording.
    pub path: PathBuf,
}

impl<'a> Drawing<'a> {
    /// The frames of a sequence and the estimates of the run of `directory` in them; the camera is `height_m` above the road
    /// \[m\].
    pub fn new(
        directory: &'a Path,
        run: RecordedRun,
        height_m: f64,
        sequence: &'a Sequence,
        threads: usize,
    ) -> anyhow::Result<Self> {
        let overlay = Overlay::new(sequence.camera()?);
        Ok(Self { sequence, scenes: Scenes::new(run, height_m), overlay, threads, directory })
    }

    /// Draws all frames and puts them in their place.
    pub fn write(&self, target: Target, reporter: &Reporter) -> anyhow::Result<Drawn> {
        reporter.begin("drawing", Some(self.sequence.len()));
        let interval_s = self.sequence.summary().interval_s;
        let fps = if interval_s > 0.0 { 1.0 / interval_s } else { 10.0 };
        let mut drawn = 0;
        let mut fill = |as_png: bool, put: Put<'_>| {
            drawn = self.draw_all(reporter, as_png, put)?;
            Ok(())
        };
        let (path, written) = match target {
            Target::Video { path, file, encoder } => {
                let size = self.overlay.size();
                let written = write_video((&path, file, encoder), size, fps, |put| fill(false, put));
                (path, written)
            }
            Target::Pictures { path, directory } => {
                let written = write_pictures(&path, &directory, |put| fill(true, put));
                (path, written)
            }
            Target::Recording { path, file } => {
                let (run, sequence) = (self.scenes.run(), self.sequence);
                let written = recording::write((&path, file), self.directory, run, sequence, reporter);
                (path, written.map(|frames| drawn = frames))
            }
        };
        reporter.finish();
        if reporter.cancelled() {
            return Err(Stopped.into());
        }
        written?;
        Ok(Drawn { frames: drawn, path })
    }

    /// Draws all frames; `put` takes them encoded, in order, with their numbers.
    fn draw_all(&self, reporter: &Reporter, as_png: bool, put: Put<'_>) -> anyhow::Result<usize> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build();
        let pool = pool.context("cannot start threads")?;
        let stop = || reporter.cancelled();
        let mut frames = self.sequence.frames();
        let (mut seen, mut drawn) = (0, 0);
        loop {
            let next = std::iter::from_fn(|| frames.next_unless(&stop));
            let batch: Vec<FrameResult> = next.take(FRAMES_A_THREAD * self.threads).collect();
            if stop() {
                return Err(Stopped.into());
            }
            if batch.is_empty() {
                return Ok(drawn);
            }
            seen += batch.len();
            let draw = |frame: FrameResult| self.one(frame, as_png, reporter);
            let done: Vec<_> = pool.install(|| batch.into_par_iter().filter_map(draw).collect());
            for (number, bytes) in done {
                put(number, bytes?)?;
                drawn += 1;
            }
            reporter.advance(seen);
        }
    }

    /// A frame drawn and encoded; `None` for one that the run does not have.
    fn one(
        &self,
        frame: FrameResult,
        as_png: bool,
        reporter: &Reporter,
    ) -> Option<(u64, anyhow::Result<Vec<u8>>)> {
        let (number, pixels) = match frame {
            Ok(frame) => (frame.number, frame.rgb().into_owned()),
            Err(bad) => {
                let (width, height) = self.sequence.size();
                reporter.warn(&bad.to_string());
                (bad.number, RgbImage::from_pixel(width, height, GREY))
            }
        };
        let scene = self.scenes.scene(number)?;
        Some((number, encode(self.overlay.draw(&pixels, &scene), as_png)))
    }
}
