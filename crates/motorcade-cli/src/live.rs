//! The live view of a run in the rerun viewer.

use motorcade::Motorcade;
use motorcade_dataset::Frame;
use motorcade_geometry::PinholeCamera;

use crate::arguments::RunArguments;
use crate::progress::Reporter;

/// A viewer beside the run; none in programs built without the feature `rerun`.
pub struct LiveView {
    #[cfg(feature = "rerun")]
    stream: Option<motorcade_rerun::Live>,
}

#[cfg(feature = "rerun")]
impl LiveView {
    /// Opens the viewer that is asked for.
    ///
    /// # Errors
    /// An address or a file that cannot be opened; a file that exists, unless `--force`.
    pub fn open(arguments: &RunArguments, camera: &PinholeCamera) -> anyhow::Result<Self> {
        let Some(target) = &arguments.rerun else { return Ok(Self { stream: None }) };
        if let motorcade_rerun::Target::File(path) = target {
            crate::draw::free(path, arguments.force)?;
        }
        Ok(Self { stream: Some(motorcade_rerun::Live::open(target, camera)?) })
    }

    /// True while a viewer is shown the frames.
    pub fn is_open(&self) -> bool {
        self.stream.is_some()
    }

    /// Shows the newest frame. A failing viewer is reported once and left out: the run goes on.
    pub fn show(&mut self, slam: &mut Motorcade, frame: Option<&Frame>, reporter: &Reporter) {
        let Some(stream) = &mut self.stream else { return };
        let Some(estimate) = slam.estimate() else { return };
        if let Err(error) = stream.show(&estimate, frame) {
            use motorcade::Progress;
            reporter.warn(&format!("{error}; nothing more is shown"));
            self.stream = None;
        }
    }
}

#[cfg(not(feature = "rerun"))]
impl LiveView {
    /// No viewer.
    ///
    /// # Errors
    /// None.
    pub fn open(_arguments: &RunArguments, _camera: &PinholeCamera) -> anyhow::Result<Self> {
        Ok(Self {})
    }

    /// Never true.
    pub fn is_open(&self) -> bool {
        false
    }

    /// Nothing to show on.
    pub fn show(&mut self, _slam: &mut Motorcade, _frame: Option<&Frame>, _reporter: &Reporter) {}
}
