//! The place of a drawing: a video, a folder of pictures, or a recording.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::{ImageFormat, RgbImage};
use motorcade::output::{OutputDirectory, io_error};
use motorcade_dataset::atomic_file::PendingFile;

use super::video::{Encoder, VideoWriter, container};
use crate::drive::command_line;
use crate::exit;

/// Name of the record of a folder of pictures, which lists them.
const PICTURES_RECORD: &str = "overlay.json";

/// Takes an encoded frame and its number.
pub type Put<'a> = &'a mut dyn FnMut(u64, Vec<u8>) -> anyhow::Result<()>;

/// The place of a drawing, checked before long work.
pub enum Target {
    /// A video file.
    Video { path: PathBuf, file: PendingFile, encoder: Encoder },
    /// A folder of PNG files named by frame number.
    Pictures { path: PathBuf, directory: OutputDirectory },
    /// An MCAP file.
    Recording { path: PathBuf, file: PendingFile },
}

/// True for a path that asks for a recording.
pub fn is_recording(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"))
}

/// The ending of a path that asks for a file of a kind that is not written.
fn ending_of_a_file(path: &Path) -> Option<String> {
    const ENDINGS: [&str; 19] = [
        "3gp", "apng", "bmp", "flv", "gif", "jpeg", "jpg", "m2ts", "mpeg", "mpg", "mts", "ogv", "png", "svg",
        "tiff", "ts", "webm", "webp", "wmv",
    ];
    let ending = path.extension()?.to_str()?.to_ascii_lowercase();
    ENDINGS.contains(&ending.as_str()).then_some(ending)
}

impl Target {
    /// Checks the place. Where ffmpeg is missing, a folder takes the place of a video, and that is said.
    ///
    /// # Errors
    /// Something that is there already, unless `force`; a place that cannot be written.
    pub fn open(out: &Path, force: bool) -> anyhow::Result<Self> {
        if is_recording(out) {
            free(out, force)?;
            let file = PendingFile::create(out).map_err(|e| io_error(out, &e))?;
            return Ok(Self::Recording { path: out.to_path_buf(), file });
        }
        if container(out).is_none() {
            if let Some(ending) = ending_of_a_file(out) {
                let expected = "expected .mp4, .m4v, .mov, .mkv or .avi for a video, .mcap for a recording, or a folder for pictures";
                return Err(motorcade::Error::Config(format!(
                    "--out {}: nothing is written as .{ending}; {expected}",
                    out.display()
                ))
                .into());
            }
            return Self::pictures(out, force);
        }
        let Some(encoder) = Encoder::find()? else {
            let folder = out.with_extension("");
            let place = folder.display();
            exit::eprint(&format!("warning: ffmpeg is not installed: no video, PNG pictures go to {place}"));
            return Self::pictures(&folder, force);
        };
        free(out, force)?;
        let file = PendingFile::create(out).map_err(|e| io_error(out, &e))?;
        Ok(Self::Video { path: out.to_path_buf(), file, encoder })
    }

    fn pictures(path: &Path, force: bool) -> anyhow::Result<Self> {
        let directory = OutputDirectory::open(path, PICTURES_RECORD, force)?;
        Ok(Self::Pictures { path: path.to_path_buf(), directory })
    }
}

/// Writes a video: `fill` puts all frames of this size \[px\] as RGB bytes.
///
/// # Errors
/// Those of `fill`, and a file that cannot be written; nothing is left behind then.
pub fn write_video(
    (path, file, encoder): (&Path, PendingFile, Encoder),
    size: (u32, u32),
    fps: f64,
    fill: impl FnOnce(Put<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut video = VideoWriter::start(path, file, encoder, size, fps)?;
    fill(&mut |_, bytes| Ok(video.put(&bytes)?))?;
    video.finish()
}

/// Writes a folder of pictures: `fill` puts all frames as PNG.
///
/// # Errors
/// Those of `fill`, and files that cannot be written; nothing is left behind then.
pub fn write_pictures(
    path: &Path,
    directory: &OutputDirectory,
    fill: impl FnOnce(Put<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let fill = |folder: &Path| {
        fill(&mut |number: u64, bytes: Vec<u8>| {
            let name = format!("{number:06}.png");
            fs::write(folder.join(&name), bytes).map_err(|e| io_error(&path.join(name), &e).into())
        })
    };
    let version = env!("CARGO_PKG_VERSION");
    directory.write(
        fill,
        |files, ()| serde_json::json!({"motorcade": version, "command": command_line(), "files": files}),
    )?;
    Ok(())
}

/// Checks that nothing is in the way of a file.
///
/// # Errors
/// Something that is there already, unless `force`.
pub fn free(path: &Path, force: bool) -> anyhow::Result<()> {
    if path.symlink_metadata().is_ok() && !force {
        let advice = "choose another place or add --force to replace it";
        return Err(motorcade::Error::Config(format!("{} is already there; {advice}", path.display())).into());
    }
    Ok(())
}

/// A drawn frame as PNG or as RGB bytes.
pub fn encode(image: RgbImage, as_png: bool) -> anyhow::Result<Vec<u8>> {
    if !as_png {
        return Ok(image.into_raw());
    }
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}
