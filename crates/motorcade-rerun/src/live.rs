//! The stream to a viewer or a file.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::str::FromStr;

use image::codecs::jpeg::JpegEncoder;
use motorcade::Estimate;
use motorcade_dataset::Frame;
use motorcade_geometry::PinholeCamera;
use nalgebra::Vector3;
use rerun::{RecordingStream, RecordingStreamBuilder, RecordingStreamError};

use crate::scene;

/// Quality of the pictures.
const JPEG_QUALITY: u8 = 80;
/// Positions in the path behind the camera.
const PATH_LENGTH: usize = 1000;

/// Why nothing can be shown.
#[derive(Debug, thiserror::Error)]
#[error("rerun: {0}")]
pub struct Error(#[from] RecordingStreamError);

/// Where estimates go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// A viewer that listens, such as `rerun+http://127.0.0.1:9876/proxy`.
    Viewer(String),
    /// A file, `.rrd`.
    File(PathBuf),
}

impl FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.starts_with("rerun") && text.contains("://") {
            Ok(Self::Viewer(text.to_owned()))
        } else if text.to_lowercase().ends_with(".rrd") {
            Ok(Self::File(text.into()))
        } else {
            Err("expected the address of a viewer, as rerun+http://127.0.0.1:9876/proxy, or a file .rrd"
                .to_owned())
        }
    }
}

/// An open stream.
pub struct Live {
    stream: RecordingStream,
    start_ns: Option<i64>,
    path: VecDeque<Vector3<f64>>,
}

impl Live {
    /// Opens the stream for frames of this camera. A viewer that is not there is waited for by rerun itself, and never stops the run.
    ///
    /// # Errors
    /// An address or a file that cannot be opened.
    pub fn open(target: &Target, camera: &PinholeCamera) -> Result<Self, Error> {
        let builder = RecordingStreamBuilder::new("motorcade");
        let stream = match target {
            Target::Viewer(address) => builder.connect_grpc_opts(address.as_str())?,
            Target::File(path) => builder.save(path)?,
        };
        stream.log_static("world", &rerun::ViewCoordinates::RIGHT_HAND_Y_DOWN())?;
        stream.log_static("world/camera/image", &scene::pinhole(camera))?;
        Ok(Self { stream, start_ns: None, path: VecDeque::new() })
    }

    /// Shows a frame and what is estimated in it.
    ///
    /// # Errors
    /// Those of the stream.
    pub fn show(&mut self, estimate: &Estimate, frame: Option<&Frame>) -> Result<(), Error> {
        let time_ns = estimate.frame.timestamp_ns;
        let start_ns = *self.start_ns.get_or_insert(time_ns);
        self.stream.set_time_sequence("frame", i64::try_from(estimate.frame.number).unwrap_or(i64::MAX));
        self.stream.set_duration_secs("time", (time_ns - start_ns) as f64 * 1e-9);
        if let Some(jpeg) = frame.and_then(jpeg) {
            self.stream.log("world/camera/image", &rerun::EncodedImage::from_file_contents(jpeg))?;
        }
        self.path.push_back(estimate.ego.world_from_camera.translation());
        if self.path.len() > PATH_LENGTH {
            self.path.pop_front();
        }
        self.stream.log("world/camera", &scene::camera(estimate))?;
        self.stream.log("world/camera_path", &scene::path(&self.path))?;
        self.stream.log("world/vehicles", &scene::vehicles(&estimate.vehicles))?;
        self.stream.log("speed/camera", &rerun::Scalars::single(estimate.speed_mps))?;
        for vehicle in &estimate.vehicles {
            let id = vehicle.id;
            self.stream
                .log(format!("speed/vehicle/{id}"), &rerun::Scalars::single(vehicle.state.speed_mps))?;
            let apart =
                vehicle.state.world_from_vehicle.translation() - estimate.ego.world_from_camera.translation();
            self.stream.log(format!("distance/{id}"), &rerun::Scalars::single(apart.norm()))?;
        }
        Ok(())
    }
}

fn jpeg(frame: &Frame) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    frame.rgb().write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY)).ok()?;
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_told_apart() {
        assert_eq!("a/b.RRD".parse(), Ok(Target::File("a/b.RRD".into())));
        let address = "rerun+http://127.0.0.1:9876/proxy";
        assert_eq!(address.parse(), Ok(Target::Viewer(address.to_owned())));
        assert!("drive.mcap".parse::<Target>().is_err());
    }
}
