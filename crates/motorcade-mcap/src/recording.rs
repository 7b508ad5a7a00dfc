//! A recording that is being written.

use std::io::{Seek, Write};
use std::path::Path;

use image::RgbImage;
use motorcade::RecordedRun;
use motorcade_geometry::PinholeCamera;

use crate::drive::Drive;
use crate::error::Error;
use crate::file::MessageFile;
use crate::{foxglove, picture, ros2};

/// Schemas of the messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Schemas {
    /// Foxglove's, as protobuf: Foxglove and rerun.
    #[default]
    Foxglove,
    /// Those of ROS 2's common interfaces, as CDR: `ros2 bag`, RViz, Foxglove.
    Ros2,
}

enum Topics {
    Foxglove(foxglove::Topics),
    Ros2(ros2::Topics),
}

/// A recording that is being written.
pub struct Recording<W: Write + Seek> {
    file: MessageFile<W>,
    topics: Topics,
    drive: Drive,
}

impl<W: Write + Seek> Recording<W> {
    /// Begins a recording of the run in `directory`, whose frames `camera` took.
    ///
    /// # Errors
    /// `speeds.csv` that is missing or does not read; a file that cannot be written.
    pub fn new(
        writer: W,
        schemas: Schemas,
        directory: &Path,
        run: RecordedRun,
        camera: PinholeCamera,
    ) -> Result<Self, Error> {
        let drive = Drive::new(directory, run, camera)?;
        let profile = if schemas == Schemas::Ros2 { "ros2" } else { "" };
        let mut file = MessageFile::begin(writer, profile)?;
        let topics = match schemas {
            Schemas::Foxglove => Topics::Foxglove(foxglove::Topics::begin(&mut file, &drive)?),
            Schemas::Ros2 => Topics::Ros2(ros2::Topics::begin(&mut file, &drive)?),
        };
        Ok(Self { file, topics, drive })
    }

    /// Writes the frame with this number of the input; false for one that the run does not have. Without a picture where the frame
    /// did not read.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn frame(&mut self, number: u64, picture: Option<&RgbImage>) -> Result<bool, Error> {
        let Some(row) = self.drive.run.row(number) else { return Ok(false) };
        let jpeg = picture.map(picture::jpeg).transpose()?;
        match &self.topics {
            Topics::Foxglove(topics) => topics.frame(&mut self.file, &self.drive, row, jpeg)?,
            Topics::Ros2(topics) => topics.frame(&mut self.file, &self.drive, row, jpeg)?,
        }
        Ok(true)
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(self) -> Result<W, Error> {
        self.file.finish()
    }
}
