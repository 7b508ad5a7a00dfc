//! Errors as exceptions.

use motorcade_perception::Error as Perception;
use motorcade_simulate::Error as Simulation;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyKeyboardInterrupt};
use pyo3::prelude::*;

create_exception!(motorcade, Error, PyException, "Base of all errors of this package.");
create_exception!(motorcade, SettingsError, Error, "Arguments or settings that cannot be.");
create_exception!(motorcade, InputError, Error, "Input that cannot be read, is corrupt or does not fit.");
create_exception!(
    motorcade,
    ResourceError,
    Error,
    "Something that is missing on this machine: room on the disk, permission to write, the program ffmpeg."
);
create_exception!(motorcade, GraphError, Error, "A pose graph that cannot be solved as it is.");

/// Why a call failed.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The pipeline.
    #[error(transparent)]
    Run(#[from] motorcade::Error),
    /// A simulated drive.
    #[error(transparent)]
    Simulation(#[from] Simulation),
    /// An evaluation.
    #[error(transparent)]
    Evaluation(#[from] motorcade_evaluate::Error),
    /// Tables of runs.
    #[error(transparent)]
    Tables(#[from] motorcade_tables::Error),
    /// A pose graph.
    #[error(transparent)]
    Graph(#[from] motorcade_graph::GraphError),
    /// An exception, raised by Python code or to be raised as it is.
    #[error(transparent)]
    Python(#[from] PyErr),
}

impl From<motorcade_dataset::Error> for Failure {
    fn from(error: motorcade_dataset::Error) -> Self {
        Self::Run(error.into())
    }
}

impl From<Perception> for Failure {
    fn from(error: Perception) -> Self {
        Self::Run(error.into())
    }
}

impl Failure {
    /// Arguments that cannot be.
    pub fn settings(message: impl Into<String>) -> Self {
        Self::Run(motorcade::Error::Config(message.into()))
    }
    /// Input that does not fit.
    pub fn input(message: impl Into<String>) -> Self {
        Self::Run(motorcade::Error::Input(message.into()))
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        let message = in_words_of_python(&failure.to_string());
        let by_code = |code: u8| match code {
            1 => SettingsError::new_err(message.clone()),
            5 => ResourceError::new_err(message.clone()),
            _ => InputError::new_err(message.clone()),
        };
        match failure {
            Failure::Python(error) => error,
            Failure::Run(motorcade::Error::Perception(Perception::Detector(error))) => {
                // What a detector written in Python raised comes back as it was.
                error.downcast::<Self>().map_or_else(|_| InputError::new_err(message), |error| *error)
            }
            Failure::Run(error) => by_code(error.exit_code()),
            Failure::Evaluation(error) => by_code(error.exit_code()),
            Failure::Tables(error) => by_code(error.exit_code()),
            Failure::Simulation(Simulation::Cancelled) => PyKeyboardInterrupt::new_err(()),
            Failure::Simulation(Simulation::Plan(_)) => by_code(1),
            Failure::Simulation(_) => by_code(5),
            Failure::Graph(error) => of_graph(&error, message),
        }
    }
}

fn of_graph(error: &motorcade_graph::GraphError, message: String) -> PyErr {
    use motorcade_graph::GraphError as E;
    match error {
        E::Option { .. } => SettingsError::new_err(message),
        E::Parse { .. } | E::Io { .. } => InputError::new_err(message),
        E::Threads(_) => ResourceError::new_err(message),
        _ => GraphError::new_err(message),
    }
}

/// Options of the command line and the arguments that stand for them here.
const OPTIONS: [(&str, &str); 19] = [
    ("--calibration", "camera"),
    ("--camera", "camera"),
    ("--detections", "detections"),
    ("--force", "force=True"),
    ("--format", "format"),
    ("--fps", "fps"),
    ("--frames", "frames"),
    ("--height", "height_m"),
    ("--keep-perception", "keep_perception=True"),
    ("--keypoints", "keypoints"),
    ("--models", "models"),
    ("--online", "online=True"),
    ("--out", "directory"),
    ("--road-masks", "road_masks"),
    ("--sequence", "sequence"),
    ("--set", "setting"),
    ("--stride", "stride"),
    ("--trajectory", "trajectory"),
    ("--vehicle-poses", "vehicle_poses"),
];

/// Replaces whole words alone: names of files may hold anything.
fn in_words_of_python(message: &str) -> String {
    let marks = |c: char| matches!(c, '`' | '"' | '\'' | '(' | ')' | ',' | '.' | ';' | ':');
    let mut out = String::with_capacity(message.len());
    for word in message.split_inclusive(char::is_whitespace) {
        let bare = word.trim_end().trim_matches(marks);
        match OPTIONS.iter().find(|(option, _)| *option == bare) {
            Some((option, argument)) => out.push_str(&word.replacen(option, argument, 1)),
            None => out.push_str(word),
        }
    }
    out
}
