//! Driving video as one [`Sequence`]: image folders, KITTI tracking / odometry / raw, video files.
//!
//! Three types to know: [`SequenceOptions`] selects an input, [`Sequence`] is an opened one, and it yields [`Frame`]s,
//! undistorted and with their ignore masks. A frame that is missing, truncated or of another size is a [`BadFrame`] in its
//! place, so that a pipeline can bridge it; only an input that cannot start is an [`Error`].
//!
//! Other files: [`Calibration`]s in several formats, KITTI [labels](read_labels), TUM and KITTI [trajectories](read_trajectory),
//! [vehicle poses](read_vehicle_poses) of other systems. The project's own calibration format is flat TOML:
//!
//! ```toml
//! fx = 721.5377      # px
//! fy = 721.5377      # px
//! cx = 609.5593      # px, pixel centres at integer coordinates
//! cy = 172.854       # px
//! width = 1242       # px, optional: checked against the frames
//! height = 375       # px, optional
//! fps = 10.0         # optional
//! height_m = 1.65    # camera above the road, optional
//! # view_deg = 80.0  # horizontal view of the undistorted frames, optional; by default the lens decides
//! [distortion]       # optional
//! model = "radial-tangential"    # the default; or "rational" (k4, k5, k6 too) or "fisheye" (k1 .. k4)
//! k1 = 0.0           # r²
//! k2 = 0.0           # r⁴
//! p1 = 0.0           # tangential
//! p2 = 0.0           # tangential
//! k3 = 0.0           # r⁶
//! ```
//!
//! Opening and reading a drive:
//!
//! ```
//! use motorcade_dataset::{Sequence, SequenceOptions};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let folder = tempfile::tempdir()?;
//! for number in [1, 2, 4] {
//!     image::GrayImage::new(64, 48).save(folder.path().join(format!("frame_{number}.png")))?;
//! }
//! std::fs::write(folder.path().join("calibration.toml"), "fx = 50.0\nfy = 50.0\ncx = 31.5\ncy = 23.5\n")?;
//!
//! let drive = Sequence::open(folder.path(), &SequenceOptions::default())?;
//! assert_eq!(drive.camera()?.width, 64);
//! assert_eq!(drive.summary().gaps, [3]);
//! for item in drive.frames() {
//!     match item {
//!         Ok(frame) => assert_eq!(frame.gray().dimensions(), (64, 48)),
//!         Err(bad) => assert_eq!(bad.number, 3), // bridge it
//!     }
//! }
//! # Ok(())
//! # }
//! ```

pub mod atomic_file;
mod calibration;
mod clock_offset;
mod distances;
mod error;
mod fnv;
mod frame;
mod geodesy;
mod gps_track;
mod input;
mod inspect;
mod labels;
mod live;
mod masks;
mod metadata;
mod options;
pub mod regular_file;
mod selection;
mod sequence;
mod source;
mod speed_record;
pub mod staging;
mod stream;
mod survey;
pub mod text;
mod trajectory;
mod turned;
mod undistort;
mod vehicle_poses;

pub use calibration::{Calibration, Cam0, HEIGHT_RANGE_M, KittiCalibration};
pub use clock_offset::ClockOffset;
pub use distances::MeasuredDistance;
pub use error::{Error, Result};
pub use fnv::Fnv;
pub use frame::{BadFrame, Frame, Pixels, gray_from_rgb};
pub use geodesy::Geodetic;
pub use gps_track::{GpsTrack, TrackPoint};
pub use inspect::{FrameTimes, LensSummary, Summary};
pub use labels::{FrameCounts, Label, MOST_IN_FRAME, read_labels};
pub use masks::{numbered_images, read_mask};
pub use metadata::{FocalKind, FocalMetadata};
pub use options::SequenceOptions;
pub use selection::{FrameRange, InvalidRange};
pub use sequence::{KITTI_HEIGHT_M, Sequence};
pub use source::{Format, IMAGE_ENDINGS};
pub use speed_record::SpeedRecord;
pub use stream::{FrameResult, Frames};
pub use trajectory::{Trajectory, read_trajectory, write_kitti, write_tum};
pub use undistort::Undistortion;
pub use vehicle_poses::{ExternalVehiclePose, read_vehicle_poses};
