//! Networks run by `rten`: pure Rust, nothing to install.

use std::path::Path;
use std::sync::Arc;

use rten::{Dimension, Model, NodeId, RunOptions, ThreadPool, ValueOrView};
use rten_tensor::prelude::*;
use rten_tensor::{NdTensor, Tensor};

use crate::error::{Error, Result};

/// A network with one input.
pub(super) struct Graph {
    model: Model,
    input: NodeId,
    outputs: Vec<NodeId>,
    threads: Arc<ThreadPool>,
}

impl Graph {
    /// The network and the shape of its input.
    pub fn load(path: &Path, bytes: Vec<u8>, threads: Arc<ThreadPool>) -> Result<(Self, Vec<Dimension>)> {
        let model = Model::load(bytes)
            .map_err(|e| Error::model(path, format!("is not a network that runs here: {e}")))?;
        let &[input] = model.input_ids() else {
            return Err(Error::inputs(path, model.input_ids().len()));
        };
        let (outputs, shape) = (model.output_ids().to_vec(), model.input_shape(0).unwrap_or_default());
        Ok((Self { model, input, outputs, threads }, shape))
    }

    /// All outputs in the order of the file, or what went wrong.
    pub fn run(&self, input: &NdTensor<f32, 4>) -> Result<Vec<Tensor<f32>>, String> {
        let mut options = RunOptions::default();
        options.thread_pool = Some(Arc::clone(&self.threads));
        let input = vec![(self.input, ValueOrView::from(input.view()))];
        let outputs = self.model.run(input, &self.outputs, Some(options)).map_err(|e| e.to_string())?;
        let tensor = |value: rten::Value| value.try_into().map_err(|_| "an output is not f32".to_owned());
        outputs.into_iter().map(tensor).collect()
    }
}
