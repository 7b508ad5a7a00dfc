//! Rows of `tracks.csv`.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Seek, SeekFrom, Write};

use motorcade_odometry::EgoFrame;
use motorcade_perception::VehicleClass;
use motorcade_vehicles::{Dimensions, Source, VehicleState};

use crate::record::FrameInfo;
use crate::relative::relative_sigma_m;

const COLUMNS: [&str; 30] = [
    "frame",
    "time_s",
    "id",
    "class",
    "x_m",
    "y_m",
    "z_m",
    "qx",
    "qy",
    "qz",
    "qw",
    "length_m",
    "width_m",
    "height_m",
    "speed_mps",
    "yaw_rate_radps",
    "sigma_forward_m",
    "sigma_left_m",
    "sigma_up_m",
    "sigma_heading_rad",
    "sigma_speed_mps",
    "sigma_length_m",
    "sigma_width_m",
    "sigma_height_m",
    "source",
    "p_moving",
    "score",
    "sigma_relative_forward_m",
    "sigma_relative_left_m",
    "sigma_relative_up_m",
];

/// A table of vehicles, one row a vehicle and frame, with the columns of `tracks.csv`.
#[derive(Debug)]
pub struct TrackTable<W: Write> {
    rows: csv::Writer<W>,
}

/// A vehicle in a frame.
pub(crate) struct TrackRow<'a> {
    pub(crate) frame: &'a FrameInfo,
    pub(crate) camera: &'a EgoFrame,
    pub(crate) id: usize,
    pub(crate) class: VehicleClass,
    /// Size and its standard deviations.
    pub(crate) sizes: [Dimensions; 2],
    pub(crate) p_moving: f64,
    pub(crate) state: &'a VehicleState,
}

impl<W: Write> TrackTable<W> {
    /// A table with its header.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn new(out: W) -> io::Result<Self> {
        let mut rows = csv::Writer::from_writer(out);
        rows.write_record(COLUMNS)?;
        Ok(Self { rows })
    }

    /// Writes what is held back.
    ///
    /// # Errors
    /// Those of the output.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.rows.flush()
    }

    pub(crate) fn write(&mut self, row: &TrackRow<'_>) -> io::Result<()> {
        let TrackRow { frame, camera, state: s, sizes: [size, size_sigma], .. } = row;
        let (t, q) = (s.world_from_vehicle.translation(), s.world_from_vehicle.rotation());
        let sigma = |i: usize| s.covariance[(i, i)].max(0.0).sqrt();
        let mut cells = vec![
            frame.number.to_string(),
            format!("{:.6}", frame.timestamp_ns as f64 * 1e-9),
            row.id.to_string(),
            row.class.name().to_owned(),
        ];
        let numbers = [
            t.x,
            t.y,
            t.z,
            q.i,
            q.j,
            q.k,
            q.w,
            size.length_m,
            size.width_m,
            size.height_m,
            s.speed_mps,
            s.yaw_rate_radps,
            sigma(3),
            sigma(4),
            sigma(5),
            sigma(2),
            s.speed_sigma_mps,
            size_sigma.length_m,
            size_sigma.width_m,
            size_sigma.height_m,
        ];
        cells.extend(numbers.iter().map(|v| format!("{v:.6}")));
        let source = match s.source {
            Source::Box => "box",
            Source::Keypoints => "keypoints",
            Source::External => "given",
            Source::Predicted => "predicted",
        };
        cells.push(source.to_owned());
        cells.extend([format!("{:.4}", row.p_moving), format!("{:.4}", s.score)]);
        cells.extend(sigma_from_camera(camera, s).map(|sigma| format!("{sigma:.6}")));
        Ok(self.rows.write_record(&cells)?)
    }
}

impl TrackTable<File> {
    /// Goes on with the table in a file, open for reading and writing: the rows of frames before `frame` stay, those from it on and a last row that was
    /// cut off are taken away. `None` for a file that is no such table.
    ///
    /// # Errors
    /// Those of the file.
    pub fn go_on(mut file: File, frame: u64) -> io::Result<Option<Self>> {
        let mut reader = BufReader::new(&mut file);
        let (mut line, mut kept) = (Vec::new(), 0);
        loop {
            line.clear();
            let bytes = reader.read_until(b'\n', &mut line)?;
            let Some(row) = line.strip_suffix(b"\n") else { break };
            let row = String::from_utf8_lossy(row);
            let stays = match kept {
                0 if row != COLUMNS.join(",") => return Ok(None),
                0 => true,
                _ => row.split(',').next().and_then(|n| n.parse::<u64>().ok()).is_some_and(|n| n < frame),
            };
            if !stays {
                break;
            }
            kept += bytes as u64;
        }
        if kept == 0 {
            return Ok(None);
        }
        file.set_len(kept)?;
        file.seek(SeekFrom::End(0))?;
        Ok(Some(Self { rows: csv::Writer::from_writer(file) }))
    }
}

/// Standard deviations of a position relative to the camera of its frame, along the vehicle's axes \[m\].
pub(super) fn sigma_from_camera(camera: &EgoFrame, state: &VehicleState) -> [f64; 3] {
    let camera_from_vehicle = camera.world_from_camera.inverse() * state.world_from_vehicle;
    let sigma_m = [3, 4, 5].map(|k| state.covariance[(k, k)].max(0.0).sqrt());
    relative_sigma_m(&camera_from_vehicle, &camera.covariance, sigma_m)
}
