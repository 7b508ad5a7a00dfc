//! Networks run by ONNX Runtime: a shared library, loaded when the first network is.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use ort::environment::Environment;
use ort::logging::LogLevel;
use ort::value::{TensorRef, ValueType};
use rten::Dimension;
use rten_tensor::prelude::*;
use rten_tensor::{NdTensor, Tensor};

use crate::error::{Error, Result};

/// Names the library; without it the system is asked for it.
const LIBRARY_VARIABLE: &str = "ORT_DYLIB_PATH";

/// A network with one input.
pub(super) struct Session {
    /// Running needs it alone; frames come one by one anyway.
    session: Mutex<ort::session::Session>,
}

impl Session {
    /// The network and the shape of its input.
    pub fn load(path: &Path, bytes: &[u8], threads: usize) -> Result<(Self, Vec<Dimension>)> {
        let environment = environment()?;
        let wrong = |e: String| Error::model(path, format!("is not a network that runs here: {e}"));
        let session = open(environment, bytes, threads).map_err(|e| wrong(e.to_string()))?;
        let ([input], [_, ..]) = (session.inputs(), session.outputs()) else {
            return Err(Error::inputs(path, session.inputs().len()));
        };
        let shape = match input.dtype() {
            ValueType::Tensor { shape, dimension_symbols, .. } => {
                let names = dimension_symbols.iter().map(String::as_str).chain(std::iter::repeat(""));
                shape.iter().zip(names).map(|(size, name)| dimension(*size, name)).collect()
            }
            other => return Err(wrong(format!("the input is {other}, expected a tensor"))),
        };
        Ok((Self { session: Mutex::new(session) }, shape))
    }

    /// All outputs in the order of the file, or what went wrong.
    pub fn run(&self, input: &NdTensor<f32, 4>) -> Result<Vec<Tensor<f32>>, String> {
        let data = input.data().ok_or("the input is not in one piece")?;
        let input = TensorRef::from_array_view((input.shape(), data)).map_err(|e| e.to_string())?;
        // A run that panicked has left nothing behind in the session.
        let mut session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
        let outputs = session.run(ort::inputs![input]).map_err(|e| e.to_string())?;
        let tensor = |value: ort::value::ValueRef<'_>| {
            let (shape, data) = value.try_extract_tensor::<f32>().map_err(|e| e.to_string())?;
            let shape: Vec<usize> = shape.iter().map(|size| usize::try_from(*size).unwrap_or(0)).collect();
            Tensor::try_from_data(shape.as_slice(), data.to_vec()).map_err(|e| e.to_string())
        };
        outputs.values().map(tensor).collect()
    }
}

fn open(environment: &Environment, bytes: &[u8], threads: usize) -> ort::Result<ort::session::Session> {
    ort::session::Session::builder(environment)?
        .with_intra_threads(threads)?
        // The same input gives the same bytes.
        .with_deterministic_compute(true)?
        // Errors are returned; stderr is the program's.
        .with_log_level(LogLevel::Fatal)?
        .commit_from_memory(bytes)
}

/// Negative sizes are open.
fn dimension(size: i64, name: &str) -> Dimension {
    match usize::try_from(size) {
        Ok(size) => Dimension::Fixed(size),
        Err(_) => Dimension::Symbolic(if name.is_empty() { "?" } else { name }.to_owned()),
    }
}

/// One for the whole process; a library that does not load is asked for again by the next network.
fn environment() -> Result<&'static Environment> {
    static ENVIRONMENT: OnceLock<Environment> = OnceLock::new();
    if let Some(environment) = ENVIRONMENT.get() {
        return Ok(environment);
    }
    let library = library();
    let missing =
        |e: String| Error::Engine { problem: format!("ONNX Runtime does not load: {e}; {}", advice()) };
    let builder = ort::init_from(&library).map_err(|e| missing(e.to_string()))?;
    let environment = builder.with_telemetry(false).build().map_err(|e| missing(e.to_string()))?;
    Ok(ENVIRONMENT.get_or_init(|| environment))
}

fn library() -> PathBuf {
    match std::env::var_os(LIBRARY_VARIABLE) {
        Some(path) if !path.is_empty() => path.into(),
        _ => format!("{}onnxruntime{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX).into(),
    }
}

fn advice() -> String {
    format!(
        "install it (`pip install onnxruntime` brings it as onnxruntime/capi/libonnxruntime.so.*), set \
         {LIBRARY_VARIABLE} to that file, or build without the feature `ort`"
    )
}
