//! The topics of a recording.

use std::io::{Seek, Write};

use foxglove::Encode;
use foxglove::messages::{
    CameraCalibration, CompressedImage, FrameTransforms, ImageAnnotations, PoseInFrame, PosesInFrame,
    SceneUpdate,
};

use super::convert::timestamp;
use super::{annotations, camera, vehicles};
use crate::drive::Drive;
use crate::error::Error;
use crate::file::{MessageFile, Schema};
use crate::frames::CAMERA;

/// Numbers of the channels in the file.
pub(crate) struct Topics {
    image: u16,
    calibration: u16,
    annotations: u16,
    pose: u16,
    transforms: u16,
    vehicles: u16,
    speeds: u16,
}

impl Topics {
    /// Adds the channels and writes the way of the camera.
    pub(crate) fn begin<W: Write + Seek>(file: &mut MessageFile<W>, drive: &Drive) -> Result<Self, Error> {
        let image = channel::<CompressedImage>(file, "/camera/image")?;
        let calibration = channel::<CameraCalibration>(file, "/camera/calibration")?;
        let annotations = channel::<ImageAnnotations>(file, "/camera/annotations")?;
        let pose = channel::<PoseInFrame>(file, "/camera/pose")?;
        let path = channel::<PosesInFrame>(file, "/camera/path")?;
        let transforms = channel::<FrameTransforms>(file, "/tf")?;
        let vehicles = channel::<SceneUpdate>(file, "/vehicles")?;
        let columns = drive.speeds.schema();
        let schema = Schema {
            name: "motorcade.Speeds",
            encoding: "jsonschema",
            text: columns.as_bytes(),
            messages: "json",
        };
        let speeds = file.channel("/speeds", &schema)?;
        if let Some(first) = drive.run.frames.first() {
            put(file, path, first.timestamp_ns, &camera::path(&drive.run))?;
        }
        Ok(Self { image, calibration, annotations, pose, transforms, vehicles, speeds })
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
        let (time_ns, states) = (frame.timestamp_ns, drive.states(row));
        put(file, self.transforms, time_ns, &camera::transforms(frame))?;
        put(file, self.pose, time_ns, &camera::pose_in_frame(frame))?;
        put(file, self.calibration, time_ns, &camera::calibration(&drive.camera, frame))?;
        if let Some(jpeg) = jpeg {
            put(file, self.image, time_ns, &compressed(jpeg, time_ns))?;
        }
        let annotations = annotations::annotations(&drive.run, row, &drive.camera, states);
        put(file, self.annotations, time_ns, &annotations)?;
        put(file, self.vehicles, time_ns, &vehicles::update(&drive.run, time_ns, states))?;
        if let Some(row) = drive.speeds.json(frame.number) {
            file.put(self.speeds, time_ns, &row)?;
        }
        Ok(())
    }
}

fn put<M: Encode, W: Write + Seek>(
    file: &mut MessageFile<W>,
    channel: u16,
    time_ns: i64,
    message: &M,
) -> Result<(), Error> {
    let mut bytes = Vec::with_capacity(message.encoded_len().unwrap_or(0));
    message.encode(&mut bytes).map_err(|e| Error::Message(e.to_string()))?;
    file.put(channel, time_ns, &bytes)
}

fn channel<M: Encode>(file: &mut MessageFile<impl Write + Seek>, topic: &str) -> Result<u16, Error> {
    let schema = M::get_schema().ok_or_else(|| Error::Message(format!("{topic} has no schema")))?;
    let messages = M::get_message_encoding();
    let (name, encoding, text) = (&schema.name, &schema.encoding, &schema.data);
    file.channel(topic, &Schema { name, encoding, text, messages: &messages })
}

fn compressed(jpeg: Vec<u8>, time_ns: i64) -> CompressedImage {
    CompressedImage {
        timestamp: Some(timestamp(time_ns)),
        frame_id: CAMERA.into(),
        data: jpeg.into(),
        format: "jpeg".into(),
    }
}
