//! All frames of a drive, drawn on several threads and written in order.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};

use anyhow::Context;
use image::{Rgb, RgbImage};
use motorcade::{Progress, RecordedRun};
use motorcade_dataset::{FrameResult, Sequence};
use motorcade_draw::Overlay;
use motorcade_mcap::Schemas;
use rayon::prelude::*;

use super::recording;
use super::rig::Rig;
use super::scenes::Scenes;
use super::target::{Put, Target, encode, write_pictures, write_video};
use crate::exit::Stopped;

const UNDRAWN: Stopped = Stopped("stopped before the last frame was drawn; the drawing was not written");
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
    /// Messages of a recording.
    schemas: Schemas,
}

/// A finished drawing.
pub struct Drawn {
    pub frames: usize,
    /// The video, the folder of pictures or the recording.
    pub path: PathBuf,
}

impl<'a> Drawing<'a> {
    /// The frames of a sequence and the estimates of the run of `directory` in them.
    pub fn new(
        directory: &'a Path,
        run: RecordedRun,
        rig: &Rig,
        sequence: &'a Sequence,
        threads: usize,
        schemas: Schemas,
    ) -> anyhow::Result<Self> {
        let overlay = Overlay::new(sequence.camera()?).with_fixed_regions(&rig.fixed_regions);
        Ok(Self { sequence, scenes: Scenes::new(run, rig.height_m), overlay, threads, directory, schemas })
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
                let place = (path.as_path(), file);
                let written = recording::write(place, self.schemas, self.directory, run, sequence, reporter);
                (path, written.map(|frames| drawn = frames))
            }
        };
        reporter.finish();
        if reporter.cancelled() {
            return Err(UNDRAWN.into());
        }
        written?;
        Ok(Drawn { frames: drawn, path })
    }

    /// Draws all frames; `put` takes them encoded, in order, with their numbers. Frames are read, drawn and put at the same time, a
    /// batch each.
    fn draw_all(&self, reporter: &Reporter, as_png: bool, put: Put<'_>) -> anyhow::Result<usize> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build();
        let pool = pool.context("cannot start threads")?;
        let (to_draw, read) = sync_channel(1);
        let (to_put, drawn) = sync_channel(1);
        // Channels close when their reader has ended: whatever stops one stage stops those before it.
        std::thread::scope(|scope| {
            scope.spawn(move || self.read_batches(reporter, &to_draw));
            scope.spawn(move || {
                let draw = |frame: FrameResult| self.one(frame, as_png, reporter);
                for batch in read {
                    let batch: Vec<FrameResult> = batch;
                    let seen = batch.len();
                    let done: Vec<_> = pool.install(|| batch.into_par_iter().filter_map(draw).collect());
                    if to_put.send((seen, done)).is_err() {
                        break;
                    }
                }
            });
            let (mut seen, mut count) = (0, 0);
            for (batch, done) in drawn {
                for (number, bytes) in done {
                    put(number, bytes?)?;
                    count += 1;
                }
                seen += batch;
                reporter.advance(seen);
            }
            if reporter.cancelled() { Err(UNDRAWN.into()) } else { Ok(count) }
        })
    }

    /// Reads all frames in batches, until it is stopped or nobody takes them.
    fn read_batches(&self, reporter: &Reporter, to: &SyncSender<Vec<FrameResult>>) {
        let stop = || reporter.cancelled();
        let mut frames = self.sequence.frames();
        loop {
            let next = std::iter::from_fn(|| frames.next_unless(&stop));
            let batch: Vec<FrameResult> = next.take(FRAMES_A_THREAD * self.threads).collect();
            if batch.is_empty() || stop() || to.send(batch).is_err() {
                return;
            }
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
