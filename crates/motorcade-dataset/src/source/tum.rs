//! Sequences in the layout of the TUM RGB-D benchmark (Sturm et al., IROS 2012), which many SLAM systems read: `rgb.txt` with a time
//! and a picture's path a line.

use std::path::{Path, PathBuf};

use super::images::calibration_beside;
use super::layout::{Choice, Contents, Layout};
use super::listing::{Entry, Listing};
use crate::error::{Error, Result};
use crate::text::{Row, TextFile};

/// The list of a sequence.
const LIST: &str = "rgb.txt";

pub(crate) struct Tum;

impl Layout for Tum {
    fn name(&self) -> &'static str {
        "tum"
    }

    fn recognises(&self, folder: &Path) -> Result<bool> {
        Ok(folder.join(LIST).is_file())
    }

    fn contents(&self, root: &Path, _: Choice<'_>) -> Result<Contents> {
        let list = root.join(LIST);
        let file = TextFile::read(&list)?;
        let (mut entries, mut times_ns) = (Vec::new(), Vec::new());
        for (number, row) in (0..).zip(file.rows()) {
            let (time_ns, path) = picture(root, &row, times_ns.last().copied())?;
            let bytes = std::fs::metadata(&path).map_or(0, |m| m.len());
            entries.push(Entry { number, path, bytes });
            times_ns.push(time_ns);
        }
        if entries.is_empty() {
            return Err(Error::input(&list, "names no pictures; expected a time [s] and a path a line"));
        }
        let mut contents = Contents::listed(Listing { entries, ..Listing::default() });
        contents.calibration = calibration_beside(root);
        contents.times_ns = Some(times_ns);
        Ok(contents)
    }
}

/// Time \[ns\] and path of a row; times must increase.
fn picture(root: &Path, row: &Row<'_>, before_ns: Option<i64>) -> Result<(i64, PathBuf)> {
    row.require_columns(&[2], "time, path of a picture")?;
    let time_ns = row.nanoseconds(0)?;
    match before_ns {
        Some(before_ns) if time_ns <= before_ns => {
            Err(row.error("a time after that of the line before", row.fields[0]))
        }
        _ => Ok((time_ns, root.join(row.fields[1]))),
    }
}
