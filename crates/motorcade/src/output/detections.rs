//! `detections.txt`: what perception saw, as KITTI tracking labels without 3D, ready to be given to `--detections`.

use std::io::Write;
use std::path::Path;

use motorcade_dataset::Label;

use super::file;
use crate::error::Result;
use crate::result::RunResult;

pub(super) fn write(folder: &Path, result: &RunResult) -> Result<()> {
    file(&folder.join("detections.txt"), |out| {
        for (frame, detections) in result.frames.iter().zip(&result.detections) {
            for d in detections {
                let label = Label {
                    frame: frame.number,
                    track: d.external_id.unwrap_or(-1),
                    class: d.class.name().to_owned(),
                    truncated: -1.0,
                    occluded: -1.0,
                    alpha_rad: -10.0,
                    bbox: d.bbox,
                    size_hwl_m: [-1.0; 3],
                    location_m: [-1000.0; 3],
                    ry_rad: -10.0,
                    score: Some(d.score),
                };
                writeln!(out, "{}", label.to_line())?;
            }
        }
        Ok(())
    })
}
