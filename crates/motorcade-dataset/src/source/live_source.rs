//! Sources that have no end known beforehand.

use std::path::{Path, PathBuf};

/// Kinds of addresses that are handed to ffmpeg.
const SCHEMES: [&str; 8] = ["rtsp", "rtsps", "rtmp", "http", "https", "udp", "tcp", "srt"];
/// Major number of the devices of Linux' video interface.
const V4L2_MAJOR: u64 = 81;
/// A live source.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum LiveSource {
    /// Standard input.
    Stdin,
    /// An address.
    Address(String),
    /// A camera.
    Device(PathBuf),
}

impl LiveSource {
    /// The live source that a path on the command line means; `None` for files and folders. What exists as a file is one.
    pub(crate) fn recognise(path: &Path) -> Option<Self> {
        if path.as_os_str() == "-" {
            return Some(Self::Stdin);
        }
        if let Ok(metadata) = std::fs::metadata(path) {
            return is_camera(&metadata).then(|| Self::Device(path.to_path_buf()));
        }
        let text = path.to_str()?;
        let (scheme, _) = text.split_once("://")?;
        SCHEMES.contains(&scheme).then(|| Self::Address(text.to_owned()))
    }

    /// Arguments of ffmpeg that read it.
    pub(super) fn arguments(&self) -> Vec<std::ffi::OsString> {
        let words: &[&str] = match self {
            Self::Stdin => &["-i", "pipe:0"],
            // Over UDP packets get lost, and with them parts of pictures.
            Self::Address(address) if address.starts_with("rtsp") => &["-rtsp_transport", "tcp", "-i"],
            Self::Address(_) => &["-i"],
            Self::Device(_) => &["-f", "v4l2", "-i"],
        };
        let place = match self {
            Self::Stdin => None,
            Self::Address(address) => Some(address.into()),
            Self::Device(path) => Some(path.into()),
        };
        words.iter().map(Into::into).chain(place).collect()
    }
}

#[cfg(target_os = "linux")]
fn is_camera(metadata: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::{FileTypeExt, MetadataExt};
    // As glibc's `major`: bits 8 to 19 and the upper half.
    let device = metadata.rdev();
    let major = (device >> 8) & 0xfff | (device >> 32) & !0xfff;
    metadata.file_type().is_char_device() && major == V4L2_MAJOR
}

#[cfg(not(target_os = "linux"))]
fn is_camera(_metadata: &std::fs::Metadata) -> bool {
    false
}
