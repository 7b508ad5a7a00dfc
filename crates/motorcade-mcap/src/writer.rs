//! The file.

use std::collections::BTreeMap;
use std::io::{Cursor, Seek, Write};
use std::path::Path;

use foxglove::Encode;
use foxglove::messages::{
    CameraCalibration, CompressedImage, FrameTransforms, ImageAnnotations, PoseInFrame, PosesInFrame,
    SceneUpdate,
};
use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use motorcade::RecordedRun;
use motorcade_geometry::PinholeCamera;

use crate::convert::timestamp;
use crate::error::Error;
use crate::speeds::Speeds;
use crate::{annotations, camera, vehicles};

/// Quality of the pictures.
const JPEG_QUALITY: u8 = 85;

/// Numbers of the channels in the file.
struct Channels {
    image: u16,
    calibration: u16,
    annotations: u16,
    pose: u16,
    path: u16,
    transforms: u16,
    vehicles: u16,
    speeds: u16,
}

/// A recording that is being written.
pub struct Recording<W: Write + Seek> {
    file: mcap::Writer<W>,
    channels: Channels,
    camera: PinholeCamera,
    run: RecordedRun,
    speeds: Speeds,
    /// Vehicle and state, by row.
    states: Vec<Vec<(usize, usize)>>,
    /// Number of the next message.
    sequence: u32,
}

impl<W: Write + Seek> Recording<W> {
    /// Begins a recording of the run in `directory`, whose frames `camera` took.
    ///
    /// # Errors
    /// `speeds.csv` that is missing or does not read; a file that cannot be written.
    pub fn new(writer: W, directory: &Path, run: RecordedRun, camera: PinholeCamera) -> Result<Self, Error> {
        let speeds = Speeds::read(&directory.join("speeds.csv"))?;
        // Pictures are nearly all of it, and they are compressed already.
        let options =
            WriteOptions::new().compression(None).library(concat!("motorcade ", env!("CARGO_PKG_VERSION")));
        let mut file = options.create(writer)?;
        let channels = Channels {
            image: channel::<CompressedImage>(&mut file, "/camera/image")?,
            calibration: channel::<CameraCalibration>(&mut file, "/camera/calibration")?,
            annotations: channel::<ImageAnnotations>(&mut file, "/camera/annotations")?,
            pose: channel::<PoseInFrame>(&mut file, "/camera/pose")?,
            path: channel::<PosesInFrame>(&mut file, "/camera/path")?,
            transforms: channel::<FrameTransforms>(&mut file, "/tf")?,
            vehicles: channel::<SceneUpdate>(&mut file, "/vehicles")?,
            speeds: {
                let schema = file.add_schema("motorcade.Speeds", "jsonschema", speeds.schema().as_bytes())?;
                file.add_channel(schema, "/speeds", "json", &BTreeMap::new())?
            },
        };
        let mut states = vec![Vec::new(); run.frames.len()];
        for (v, vehicle) in run.vehicles.iter().enumerate() {
            for (s, state) in vehicle.states.iter().enumerate() {
                if let Some(row) = states.get_mut(state.row) {
                    row.push((v, s));
                }
            }
        }
        let mut recording = Self { file, channels, camera, run, speeds, states, sequence: 0 };
        if let Some(first) = recording.run.frames.first() {
            let (channel, time_ns) = (recording.channels.path, first.timestamp_ns);
            let path = camera::path(&recording.run);
            recording.put(channel, time_ns, &path)?;
        }
        Ok(recording)
    }

    /// Writes the frame with this number of the input; false for one that the run does not have. Without a picture where the frame
    /// did not read.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn frame(&mut self, number: u64, picture: Option<&RgbImage>) -> Result<bool, Error> {
        let Some(row) = self.run.row(number) else { return Ok(false) };
        let frame = self.run.frames[row].clone();
        let (time_ns, states) = (frame.timestamp_ns, std::mem::take(&mut self.states[row]));
        self.put(self.channels.transforms, time_ns, &camera::transforms(&frame))?;
        self.put(self.channels.pose, time_ns, &camera::pose_in_frame(&frame))?;
        self.put(self.channels.calibration, time_ns, &camera::calibration(&self.camera, &frame))?;
        if let Some(picture) = picture {
            self.put(self.channels.image, time_ns, &compressed(picture, time_ns)?)?;
        }
        let annotations = annotations::annotations(&self.run, row, &self.camera, &states);
        self.put(self.channels.annotations, time_ns, &annotations)?;
        self.put(self.channels.vehicles, time_ns, &vehicles::update(&self.run, time_ns, &states))?;
        if let Some(row) = self.speeds.row(number) {
            self.put_bytes(self.channels.speeds, time_ns, &row)?;
        }
        Ok(true)
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(mut self) -> Result<W, Error> {
        self.file.finish()?;
        Ok(self.file.into_inner())
    }

    fn put<M: Encode>(&mut self, channel: u16, time_ns: i64, message: &M) -> Result<(), Error> {
        let mut bytes = Vec::with_capacity(message.encoded_len().unwrap_or(0));
        message.encode(&mut bytes).map_err(|e| Error::Message(e.to_string()))?;
        self.put_bytes(channel, time_ns, &bytes)
    }

    fn put_bytes(&mut self, channel_id: u16, time_ns: i64, bytes: &[u8]) -> Result<(), Error> {
        let time = u64::try_from(time_ns).unwrap_or(0);
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time: time, publish_time: time };
        self.sequence = self.sequence.wrapping_add(1);
        Ok(self.file.write_to_known_channel(&header, bytes)?)
    }
}

fn channel<M: Encode>(file: &mut mcap::Writer<impl Write + Seek>, topic: &str) -> Result<u16, Error> {
    let schema = M::get_schema().ok_or_else(|| Error::Message(format!("{topic} has no schema")))?;
    let id = file.add_schema(&schema.name, &schema.encoding, &schema.data)?;
    Ok(file.add_channel(id, topic, &M::get_message_encoding(), &BTreeMap::new())?)
}

fn compressed(picture: &RgbImage, time_ns: i64) -> Result<CompressedImage, Error> {
    let mut jpeg = Cursor::new(Vec::new());
    JpegEncoder::new_with_quality(&mut jpeg, JPEG_QUALITY).encode_image(picture)?;
    Ok(CompressedImage {
        timestamp: Some(timestamp(time_ns)),
        frame_id: camera::CAMERA.into(),
        data: jpeg.into_inner().into(),
        format: "jpeg".into(),
    })
}
