//! Networks run by `rten`: pure Rust, nothing to install.

use std::path::Path;
use std::sync::Arc;

use rten::{Dimension, Model, NodeId, RunOptions, ThreadPool, ValueOrView};
use rten_tensor::prelude::*;
use rten_tensor::{NdTensor, Tensor};

use crate::error::{Error, Result};

/// A network with one input and one output that counts.
pub(super) struct Graph {
    model: Model,
    input: NodeId,
    output: NodeId,
    threads: Arc<ThreadPool>,
}

impl Graph {
    /// The network and the shape of its input.
    pub fn load(path: &Path, bytes: Vec<u8>, threads: Arc<ThreadPool>) -> Result<(Self, Vec<Dimension>)> {
        let model = Model::load(bytes)
            .map_err(|e| Error::model(path, format!("is not a network that runs here: {e}")))?;
        let (&[input], &[output, ..]) = (model.input_ids(), model.output_ids()) else {
            return Err(Error::inputs(path, model.input_ids().len()));
        };
        let shape = model.input_shape(0).unwrap_or_default();
        Ok((Self { model, input, output, threads }, shape))
    }

    /// The first output, or what went wrong.
    pub fn run(&self, input: &NdTensor<f32, 4>) -> Result<Tensor<f32>, String> {
        let mut options = RunOptions::default();
        options.thread_pool = Some(Arc::clone(&self.threads));
        let input = vec![(self.input, ValueOrView::from(input.view()))];
        let outputs = self.model.run(input, &[self.output], Some(options)).map_err(|e| e.to_string())?;
        let first = outputs.into_iter().next().ok_or("no output")?;
        first.try_into().map_err(|_| "the output is not f32".to_owned())
    }
}
