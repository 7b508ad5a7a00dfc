//! Options of a sequence.

use std::path::PathBuf;

use crate::selection::FrameRange;
use crate::source::Format;

/// Options of [`Sequence::open`](crate::Sequence::open). The default recognises the format and takes every frame.
#[derive(Clone, Debug)]
pub struct SequenceOptions {
    /// Kind of input; recognised when absent.
    pub format: Option<Format>,
    /// Name of the sequence in a KITTI tracking split.
    pub sequence: Option<String>,
    /// Camera of a KITTI rig; tracking defaults to 2, others to the first one present.
    pub camera: Option<u8>,
    /// Calibration file; KITTI input has its own.
    pub calibration: Option<PathBuf>,
    /// True leaves out every calibration: frames come as the camera made them.
    pub uncalibrated: bool,
    /// Frames per second where the input has no times of its own (then 10), and instead of a video's own rate.
    pub fps: Option<f64>,
    /// Frames to take, by the input's own numbers.
    pub frames: FrameRange,
    /// Take every `stride`-th of them; at least 1.
    pub stride: usize,
    /// Mask or folder of masks of pixels to ignore.
    pub ignore: Option<PathBuf>,
    /// Frames decoded ahead on a thread of their own; 0 decodes where they are asked for.
    pub prefetch: usize,
    /// Takes sources without a known end too: standard input (`-`), addresses (`rtsp://…`), cameras.
    pub live: bool,
}

impl Default for SequenceOptions {
    fn default() -> Self {
        Self {
            format: None,
            sequence: None,
            camera: None,
            calibration: None,
            fps: None,
            frames: FrameRange::default(),
            uncalibrated: false,
            stride: 1,
            ignore: None,
            // Overlaps decoding with computation at a bounded number of frames in memory.
            prefetch: 3,
            live: false,
        }
    }
}
