//! One ONNX file ready to run.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use motorcade_dataset::regular_file;
use rten::{Dimension, ThreadPool};
use rten_tensor::{NdTensor, Tensor};

#[cfg(feature = "ort")]
use super::onnx_runtime::Session;
use super::options::{Engine, ModelOptions};
use super::rten_engine::Graph;
use super::{onnx_bounds, onnx_constants};
use crate::digest::sha256;
use crate::error::{Error, Result};
use crate::manifest::{InputSpec, ModelEntry, OutputSpec};

/// A network in the hands of its engine.
enum Loaded {
    Rten(Box<Graph>),
    #[cfg(feature = "ort")]
    OnnxRuntime(Session),
}

/// A network with one input `[N, C, H, W]`.
pub struct Network {
    path: PathBuf,
    name: String,
    loaded: Loaded,
    pub(super) spec: InputSpec,
    /// Input height and width \[px\].
    pub(super) size: (usize, usize),
}

impl std::fmt::Debug for Network {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Network").field("name", &self.name).field("size", &self.size).finish_non_exhaustive()
    }
}

impl Network {
    /// Loads the file of a manifest entry and checks that it takes images. `threads` are those of
    /// `rten`; ONNX Runtime has its own.
    ///
    /// # Errors
    /// A file that does not read, is not the one of the manifest, or no network of one image; an engine that is not there.
    pub fn load(
        folder: &Path,
        entry: &ModelEntry,
        options: &ModelOptions,
        threads: &Arc<ThreadPool>,
    ) -> Result<Self> {
        let path = folder.join(&entry.file);
        let bytes = regular_file::read(&path)
            .map_err(|e| Error::model(&path, format!("network does not read: {e}")))?;
        Self::from_bytes(path, bytes, entry, options, threads)
    }

    /// As [`load`](Self::load), for a file in memory; `path` stands in messages.
    pub(crate) fn from_bytes(
        path: PathBuf,
        bytes: Vec<u8>,
        entry: &ModelEntry,
        options: &ModelOptions,
        threads: &Arc<ThreadPool>,
    ) -> Result<Self> {
        if let Some(expected) = &entry.sha256 {
            let found = sha256(&bytes);
            if !found.eq_ignore_ascii_case(expected) {
                return Err(Error::model(&path, format!("SHA-256 is {found}, the manifest says {expected}")));
            }
        }
        onnx_bounds::check(&bytes)
            .map_err(|problem| Error::model(&path, format!("is no whole ONNX file: {problem}")))?;
        onnx_constants::check(&bytes)
            .map_err(|problem| Error::model(&path, format!("is a network that does not fit: {problem}")))?;
        let (loaded, shape) = match options.engine {
            Engine::Rten => {
                let (graph, shape) = Graph::load(&path, bytes, Arc::clone(threads))?;
                (Loaded::Rten(Box::new(graph)), shape)
            }
            #[cfg(feature = "ort")]
            Engine::OnnxRuntime => {
                let (session, shape) = Session::load(&path, &bytes, options.threads.max(1))?;
                (Loaded::OnnxRuntime(session), shape)
            }
        };
        let size = input_size(&path, &shape, entry)?;
        let (name, spec) = (entry.name.clone(), entry.input.clone());
        Ok(Self { path, name, loaded, spec, size })
    }

    /// Name in the manifest.
    pub fn name(&self) -> &str {
        &self.name
    }
    /// Name of its engine.
    pub fn engine(&self) -> &'static str {
        match &self.loaded {
            Loaded::Rten(_) => "rten",
            #[cfg(feature = "ort")]
            Loaded::OnnxRuntime(_) => "ONNX Runtime",
        }
    }
    /// Its name, and the engine where that is not the one built in.
    pub fn description(&self) -> String {
        match self.engine() {
            "rten" => format!("network {}", self.name),
            engine => format!("network {} by {engine}", self.name),
        }
    }
    /// Input width and height \[px\].
    pub fn input_size(&self) -> (usize, usize) {
        (self.size.1, self.size.0)
    }

    /// Runs on a `[1, 3, H, W]` input; the first output.
    pub(super) fn run(&self, input: NdTensor<f32, 4>) -> Result<Tensor<f32>> {
        let first = self.run_all(input)?.into_iter().next();
        first.ok_or_else(|| Error::model(&self.path, "has no output"))
    }

    /// Runs on a `[N, C, H, W]` input; all outputs in the order of the file.
    pub(super) fn run_all(&self, input: NdTensor<f32, 4>) -> Result<Vec<Tensor<f32>>> {
        let output = match &self.loaded {
            Loaded::Rten(graph) => graph.run(&input),
            #[cfg(feature = "ort")]
            Loaded::OnnxRuntime(session) => session.run(&input),
        };
        output.map_err(|e| Error::model(&self.path, format!("running failed: {e}")))
    }

    pub(super) fn wrong_output(&self, shape: &[usize], expected: &str) -> Error {
        Error::model(
            &self.path,
            format!("output has shape {shape:?}, expected {expected}; check its kind in the manifest"),
        )
    }
}

/// Height and width of the input of a network of this kind; (0, 0) where the image decides.
fn input_size(path: &Path, shape: &[Dimension], entry: &ModelEntry) -> Result<(usize, usize)> {
    let takes = |expected: [Option<usize>; 4]| {
        let one = |(found, expected): (&Dimension, Option<usize>)| match (found, expected) {
            (Dimension::Fixed(found), Some(expected)) => *found == expected,
            (Dimension::Fixed(_), None) => false,
            (Dimension::Symbolic(_), _) => true,
        };
        shape.len() == 4 && shape.iter().zip(expected).all(one)
    };
    let wrong = |expected: &str| {
        let dimensions: Vec<String> = shape.iter().map(in_words).collect();
        Err(Error::model(path, format!("input has shape [{}], expected {expected}", dimensions.join(", "))))
    };
    match entry.output {
        OutputSpec::Yolox { .. }
        | OutputSpec::Ssd { .. }
        | OutputSpec::CentrePoint { .. }
        | OutputSpec::Segmentation { .. } => image_size(path, shape, entry.input.size),
        OutputSpec::Scene { .. } if takes([Some(1), Some(3), None, None]) => Ok((0, 0)),
        OutputSpec::Scene { .. } => wrong("[1, 3, height, width] with open height and width"),
        OutputSpec::Keypoints { .. } if takes([None, Some(4), Some(64), Some(64)]) => Ok((64, 64)),
        OutputSpec::Keypoints { .. } => wrong("[N, 4, 64, 64] with open N"),
    }
}

/// Longest side of an input \[px\].
const LONGEST_SIDE: usize = 8192;

fn fits(height: usize, width: usize) -> bool {
    (1..=LONGEST_SIDE).contains(&height) && (1..=LONGEST_SIDE).contains(&width)
}

/// Height and width of an image input.
fn image_size(path: &Path, shape: &[Dimension], given: Option<[usize; 2]>) -> Result<(usize, usize)> {
    let wrong = |what: &str| {
        let dimensions: Vec<String> = shape.iter().map(in_words).collect();
        Err(Error::model(path, format!("input has shape [{}], expected {what}", dimensions.join(", "))))
    };
    let [batch, channels, height, width] = shape else { return wrong("[1, 3, height, width]") };
    let is = |dimension: &Dimension, n: usize| matches!(dimension, Dimension::Fixed(found) if *found == n);
    let open = |dimension: &Dimension| !matches!(dimension, Dimension::Fixed(_));
    if !(is(batch, 1) || open(batch)) || !(is(channels, 3) || open(channels)) {
        return wrong("[1, 3, height, width]");
    }
    match (height, width, given) {
        (Dimension::Fixed(h), Dimension::Fixed(w), None) if fits(*h, *w) => Ok((*h, *w)),
        (h, w, Some(given)) if (open(h) || is(h, given[0])) && (open(w) || is(w, given[1])) => {
            if fits(given[0], given[1]) {
                Ok((given[0], given[1]))
            } else {
                wrong(&format!("1 to {LONGEST_SIDE} px a side in input.size"))
            }
        }
        (_, _, Some(given)) => wrong(&format!("[1, 3, {}, {}] as the manifest says", given[0], given[1])),
        (Dimension::Fixed(_), Dimension::Fixed(_), None) => wrong(&format!("1 to {LONGEST_SIDE} px a side")),
        _ => wrong("a fixed size, or input.size = [height, width] in the manifest"),
    }
}

fn in_words(dimension: &Dimension) -> String {
    match dimension {
        Dimension::Fixed(size) => size.to_string(),
        Dimension::Symbolic(name) => name.clone(),
    }
}
