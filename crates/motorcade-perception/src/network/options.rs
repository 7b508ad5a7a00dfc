//! Options of inference.

use super::detector_options::DetectorOptions;

/// Inference engine. The results of two engines differ by rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Engine {
    /// `rten`, built in.
    #[cfg_attr(not(feature = "ort"), default)]
    Rten,
    /// ONNX Runtime, a library of the system; the default where the feature `ort` builds it in.
    #[cfg(feature = "ort")]
    #[default]
    OnnxRuntime,
}

/// Options of inference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelOptions {
    /// Threads of one network; at least 1. The result is the same for any number.
    pub threads: usize,
    /// Scores, crops and suppression of boxes.
    pub detectors: DetectorOptions,
    /// Inference engine.
    pub engine: Engine,
}

impl Default for ModelOptions {
    fn default() -> Self {
        Self { threads: 1, detectors: DetectorOptions::default(), engine: Engine::default() }
    }
}
