//! The topics of a recording.

use std::io::{Seek, Write};

use super::cdr::Cdr;
use super::definitions::definition;
use super::{camera, vehicles};
use crate::drive::Drive;
use crate::error::Error;
use crate::file::{MessageFile, Schema};

/// Columns of `speeds.csv` that are no measurements.
const NO_NUMBERS: [&str; 4] = ["frame", "time_s", "ahead_id", "ahead_class"];

/// Numbers of the channels in the file.
pub(crate) struct Topics {
    image: u16,
    info: u16,
    pose: u16,
    transforms: u16,
    vehicles: u16,
    /// By column of `speeds.csv`.
    speeds: Vec<(String, u16)>,
}

impl Topics {
    /// Adds the channels and writes the way of the camera.
    pub(crate) fn begin<W: Write + Seek>(file: &mut MessageFile<W>, drive: &Drive) -> Result<Self, Error> {
        let image = channel(file, "/camera/image/compressed", "sensor_msgs/msg/CompressedImage")?;
        let info = channel(file, "/camera/camera_info", "sensor_msgs/msg/CameraInfo")?;
        let pose = channel(file, "/camera/pose", "geometry_msgs/msg/PoseWithCovarianceStamped")?;
        let path = channel(file, "/camera/path", "nav_msgs/msg/Path")?;
        let transforms = channel(file, "/tf", "tf2_msgs/msg/TFMessage")?;
        let vehicles = channel(file, "/vehicles", "visualization_msgs/msg/MarkerArray")?;
        let mut speeds = Vec::new();
        for column in drive.speeds.columns().iter().filter(|c| !NO_NUMBERS.contains(&c.as_str())) {
            speeds
                .push((column.clone(), channel(file, &format!("/speeds/{column}"), "std_msgs/msg/Float64")?));
        }
        if let Some(first) = drive.run.frames.first() {
            file.put(path, first.timestamp_ns, &camera::path(&drive.run).into_bytes())?;
        }
        Ok(Self { image, info, pose, transforms, vehicles, speeds })
    }

    /// Writes the frame in a row, with its picture.
    pub(crate) fn frame<W: Write + Seek>(
        &self,
        file: &mut MessageFile<W>,
        drive: &Drive,
        row: usize,
        jpeg: Option<Vec<u8>>,
    ) -> Result<(), Error> {
        let Some(frame) = drive.frame(row) else { return Ok(()) };
        let time_ns = frame.timestamp_ns;
        let mut put = |channel, message: Cdr| file.put(channel, time_ns, &message.into_bytes());
        put(self.transforms, camera::transforms(frame))?;
        put(self.pose, camera::pose_with_covariance(frame))?;
        put(self.info, camera::info(&drive.camera, time_ns))?;
        if let Some(jpeg) = jpeg {
            put(self.image, camera::image(&jpeg, time_ns))?;
        }
        put(self.vehicles, vehicles::markers(&drive.run, time_ns, drive.states(row)))?;
        for (column, channel) in &self.speeds {
            if let Some(value) = drive.speeds.number(frame.number, column) {
                let mut number = Cdr::new();
                number.f64(value);
                put(*channel, number)?;
            }
        }
        Ok(())
    }
}

fn channel<W: Write + Seek>(file: &mut MessageFile<W>, topic: &str, name: &str) -> Result<u16, Error> {
    let text = definition(name);
    file.channel(topic, &Schema { name, encoding: "ros2msg", text: text.as_bytes(), messages: "cdr" })
}
