//! All that is known of a drive between two frames, to go on with in another process.

use std::io::Write;
use std::path::Path;

use motorcade_dataset::{Fnv, Frame, Pixels};
use motorcade_perception::SkippedFrame;
use serde::{Deserialize, Serialize};

use super::Motorcade;
use crate::error::{Error, Result};
use crate::estimator::SlidingState;
use crate::fixed_parts::FixedParts;
use crate::front_end::FrontEndState;
use crate::picture_faults::PictureFaults;
use crate::repeated_frames::RepeatedFrames;

/// Every how many bytes of a picture its hash takes one: it tells a picture from another one, and is made of every frame.
const HASHED: usize = 997;

/// State of a [`Motorcade`], without what its configuration gives.
#[derive(Serialize, Deserialize)]
struct DriveState<'a> {
    front_end: FrontEndState,
    /// Of drives that are estimated frame by frame.
    sliding: Option<SlidingState<'a>>,
    fixed: FixedParts,
    repeated: RepeatedFrames,
    pictures: PictureFaults,
    last_picture: Option<String>,
}

/// Rows that an earlier process took.
#[derive(Clone, Debug)]
pub(crate) struct Resumed {
    /// Count.
    pub(crate) rows: usize,
    /// Number of the last one.
    number: u64,
    /// Hash of its picture, where it had one.
    picture: Option<String>,
}

impl Resumed {
    /// True where the last row had a picture to compare.
    pub(crate) fn has_picture(&self) -> bool {
        self.picture.is_some()
    }

    /// Checks that a frame is the one of the last row.
    pub(crate) fn check(&self, frame: Option<&Frame>) -> Result<()> {
        if frame.is_some_and(|f| f.number == self.number && Some(picture_hash(f)) == self.picture) {
            return Ok(());
        }
        let number = self.number;
        Err(Error::Input(format!(
            "frame {number} is not the picture that the stopped run had there; run without --resume to start over"
        )))
    }
}

impl Motorcade {
    /// Has rows that only the end of the drive needs put away in files of this folder, in place of files without a name: the state
    /// ([`state`](Self::state)) of a long drive can then be kept. To be called before the first frame; the folder is made when it is needed.
    pub fn put_rows_in(&mut self, folder: &Path) {
        self.front_end.put_rows_in(folder);
        self.sliding.put_rows_in(folder);
    }

    /// All that is known after the last frame, as bytes. A [`Motorcade`] of the same camera, height and configuration that
    /// [resumes](Self::resume) with it gives the same bits for the frames to come.
    ///
    /// # Errors
    /// Rows that could not be put away in a file with a name.
    pub fn state(&self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.write_state(&mut bytes)?;
        Ok(bytes)
    }

    /// Writes the [`state`](Self::state), without holding its bytes.
    ///
    /// # Errors
    /// Those of [`state`](Self::state), and of the writer, whose reason is not told.
    pub fn write_state(&self, to: &mut dyn Write) -> Result<()> {
        // A field that is new does not compile here until it is kept or known to be no state.
        let Self {
            settings: _,
            perception: _,
            front_end,
            fixed,
            repeated,
            pictures,
            sliding,
            last_picture,
            resumed: _,
        } = self;
        let state = DriveState {
            front_end: front_end.state()?,
            sliding: if sliding.is_empty() { None } else { Some(sliding.state()?) },
            fixed: fixed.clone(),
            repeated: repeated.clone(),
            pictures: pictures.clone(),
            last_picture: last_picture.clone(),
        };
        postcard::to_io(&state, to).map_err(|e| unusable(&e.to_string()))?;
        Ok(())
    }

    /// Goes on after the last frame of a [`state`](Self::state), before any frame was taken. Detectors pass over the frames before
    /// ([`Perception::skip`](motorcade_perception::Perception::skip)); [`push_sequence`](crate::push_sequence) begins after them, once it has seen that the
    /// sequence has the same picture there.
    ///
    /// # Errors
    /// Bytes that are no such state, or not one of this configuration; files of rows that are gone; a checkpoint of perception that
    /// does not reach as far. Nothing has changed then.
    pub fn resume(&mut self, state: &[u8]) -> Result<()> {
        if self.frames() > 0 {
            return Err(unusable("frames were taken already"));
        }
        let (state, rest) = postcard::take_from_bytes(state).map_err(|e| unusable(&e.to_string()))?;
        if !rest.is_empty() {
            return Err(unusable("there is more than a state"));
        }
        let DriveState { front_end, sliding, fixed, repeated, pictures, last_picture } = state;
        let front_end = self.front_end.resumed(front_end, &self.settings)?;
        let sliding = sliding.map(|sliding| self.sliding.resumed(sliding, &self.settings)).transpose()?;
        if sliding.as_ref().is_some_and(|sliding| sliding.len() > front_end.len()) {
            return Err(unusable("it has estimates of frames that it does not have"));
        }
        let frames = &front_end.record().frames;
        let Some(number) = frames.last().map(|f| f.number) else { return Err(unusable("it has no frames")) };
        let skipped = frames.iter().map(|f| SkippedFrame {
            number: f.number,
            timestamp_ns: f.timestamp_ns,
            observed: f.problem.is_none(),
        });
        self.perception.skip(&skipped.collect::<Vec<_>>())?;
        self.resumed = Some(Resumed { rows: frames.len(), number, picture: last_picture.clone() });
        self.front_end = front_end;
        sliding.into_iter().for_each(|sliding| self.sliding = sliding);
        self.fixed = self.fixed.resumed(fixed);
        self.repeated = self.repeated.resumed(repeated);
        (self.pictures, self.last_picture) = (pictures, last_picture);
        Ok(())
    }

    /// The rows that are not to be taken again, once.
    pub(crate) fn take_resumed(&mut self) -> Option<Resumed> {
        self.resumed.take()
    }
}

fn unusable(why: &str) -> Error {
    Error::Input(format!("the state does not fit: {why}"))
}

/// A hash of some of the bytes of a picture.
pub(super) fn picture_hash(frame: &Frame) -> String {
    let bytes: &[u8] = match &frame.pixels {
        Pixels::Gray(image) => image.as_raw(),
        Pixels::Rgb(image) => image.as_raw(),
    };
    let some: Vec<u8> = bytes.iter().step_by(HASHED).copied().collect();
    Fnv::of(&some).to_string()
}
