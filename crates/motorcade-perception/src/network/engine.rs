//! One ONNX file ready to run.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rten::{Dimension, Model, NodeId, RunOptions, ThreadPool, ValueOrView};
use rten_tensor::prelude::*;
use rten_tensor::{NdTensor, Tensor};
use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::manifest::{InputSpec, ModelEntry};

/// A network with one image input `[1, 3, H, W]` and one output.
pub struct Network {
    path: PathBuf,
    name: String,
    model: Model,
    input: NodeId,
    output: NodeId,
    pub(super) spec: InputSpec,
    /// Input height and width \[px\].
    pub(super) size: (usize, usize),
    threads: Arc<ThreadPool>,
}

impl std::fmt::Debug for Network {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Network").field("name", &self.name).field("size", &self.size).finish_non_exhaustive()
    }
}

impl Network {
    /// Loads the file of a manifest entry and checks that it takes images.
    pub fn load(folder: &Path, entry: &ModelEntry, threads: &Arc<ThreadPool>) -> Result<Self> {
        let path = folder.join(&entry.file);
        let bytes =
            std::fs::read(&path).map_err(|e| Error::model(&path, format!("network does not read: {e}")))?;
        if let Some(expected) = &entry.sha256 {
            let found: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
            if !found.eq_ignore_ascii_case(expected) {
                return Err(Error::model(&path, format!("SHA-256 is {found}, the manifest says {expected}")));
            }
        }
        let model = Model::load(bytes)
            .map_err(|e| Error::model(&path, format!("is not a network that runs here: {e}")))?;
        let (&[input], &[output, ..]) = (model.input_ids(), model.output_ids()) else {
            let problem = format!("has {} inputs, expected one image", model.input_ids().len());
            return Err(Error::model(&path, problem));
        };
        let size = image_size(&path, model.input_shape(0), entry.input.size)?;
        let (name, spec) = (entry.name.clone(), entry.input.clone());
        Ok(Self { path, name, model, input, output, spec, size, threads: Arc::clone(threads) })
    }

    /// Name in the manifest.
    pub fn name(&self) -> &str {
        &self.name
    }
    /// Input width and height \[px\].
    pub fn input_size(&self) -> (usize, usize) {
        (self.size.1, self.size.0)
    }

    /// Runs on a `[1, 3, H, W]` input.
    pub(super) fn run(&self, input: NdTensor<f32, 4>) -> Result<Tensor<f32>> {
        let mut options = RunOptions::default();
        options.thread_pool = Some(Arc::clone(&self.threads));
        let input = vec![(self.input, ValueOrView::from(input.view()))];
        let failed = |e: String| Error::model(&self.path, format!("running failed: {e}"));
        let outputs =
            self.model.run(input, &[self.output], Some(options)).map_err(|e| failed(e.to_string()))?;
        let first = outputs.into_iter().next().ok_or_else(|| failed("no output".into()))?;
        first.try_into().map_err(|_| failed("the output is not f32".into()))
    }

    pub(super) fn wrong_output(&self, shape: &[usize], expected: &str) -> Error {
        Error::model(
            &self.path,
            format!("output has shape {shape:?}, expected {expected}; check its kind in the manifest"),
        )
    }
}

/// Height and width of an image input.
fn image_size(
    path: &Path,
    shape: Option<Vec<Dimension>>,
    given: Option<[usize; 2]>,
) -> Result<(usize, usize)> {
    let shape = shape.unwrap_or_default();
    let wrong = |what: &str| {
        let dimensions: Vec<String> = shape.iter().map(in_words).collect();
        Err(Error::model(path, format!("input has shape [{}], expected {what}", dimensions.join(", "))))
    };
    let [batch, channels, height, width] = shape.as_slice() else { return wrong("[1, 3, height, width]") };
    let is = |dimension: &Dimension, n: usize| matches!(dimension, Dimension::Fixed(found) if *found == n);
    let open = |dimension: &Dimension| !matches!(dimension, Dimension::Fixed(_));
    if !(is(batch, 1) || open(batch)) || !(is(channels, 3) || open(channels)) {
        return wrong("[1, 3, height, width]");
    }
    match (height, width, given) {
        (Dimension::Fixed(h), Dimension::Fixed(w), None) => Ok((*h, *w)),
        (h, w, Some(given)) if (open(h) || is(h, given[0])) && (open(w) || is(w, given[1])) => {
            Ok((given[0], given[1]))
        }
        (_, _, Some(given)) => wrong(&format!("[1, 3, {}, {}] as the manifest says", given[0], given[1])),
        _ => wrong("a fixed size, or input.size = [height, width] in the manifest"),
    }
}

fn in_words(dimension: &Dimension) -> String {
    match dimension {
        Dimension::Fixed(size) => size.to_string(),
        Dimension::Symbolic(name) => name.clone(),
    }
}
