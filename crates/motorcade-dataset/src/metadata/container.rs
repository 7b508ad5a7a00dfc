//! Tags of a video.

use std::path::Path;
use std::process::{Command, Stdio};

use super::focal::{FocalKind, FocalMetadata};
use crate::source::video::file_url;

/// End of the key under which telephones write it (`com.apple.quicktime.camera.focal_length.35mm_equivalent`).
const FILM_KEY: &str = "focal_length.35mm_equivalent";

/// Focal length by the tags of a video whose pictures have `size` px; `None` where `ffprobe` reports none.
pub(super) fn focal(path: &Path, size: (u32, u32)) -> Option<FocalMetadata> {
    let output = Command::new("ffprobe")
        .args(["-v", "error", "-show_entries", "format_tags:stream_tags", "-of", "default=nw=1", "-i"])
        .arg(file_url(path))
        .stdin(Stdio::null())
        .output()
        .ok()?;
    FocalMetadata::of_film(film_mm(&String::from_utf8_lossy(&output.stdout))?, size, FocalKind::ContainerFilm)
}

/// The 35 mm equivalent among the lines `TAG:key=value`.
fn film_mm(text: &str) -> Option<f64> {
    let of = |line: &str| {
        let (key, value) = line.strip_prefix("TAG:")?.split_once('=')?;
        key.to_ascii_lowercase().ends_with(FILM_KEY).then(|| value.trim().parse().ok())?
    };
    text.lines().find_map(of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tag_of_telephones_is_found() {
        let tags = "TAG:major_brand=qt\nTAG:com.apple.quicktime.camera.focal_length.35mm_equivalent=26\nTAG:encoder=x\n";
        assert_eq!(film_mm(tags), Some(26.0));
        assert_eq!(film_mm("TAG:comment=focal_length.35mm_equivalent=26\n"), None);
        assert_eq!(film_mm("TAG:com.apple.quicktime.camera.focal_length.35mm_equivalent=wide\n"), None);
    }
}
