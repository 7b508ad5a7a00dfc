//! KITTI tracking labels, as ground truth or as results.

use std::collections::BTreeMap;
use std::path::Path;

use motorcade_geometry::BoundingBox;

use crate::error::Result;
use crate::text::{Row, TextFile};

const LAYOUT: &str = "frame, track id, type, truncated, occluded, alpha, box x1 y1 x2 y2, size h w l, location x y z, ry, score at most";

/// One object in one frame. The location is the centre of the bottom face in rectified cam0 coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// Frame number.
    pub frame: u64,
    /// Track identity; −1 when none was given.
    pub track: i64,
    /// `Car`, `Van`, ..
    pub class: String,
    /// Truncation, 0 = not; results have −1.
    pub truncated: f64,
    /// Occlusion, 0 = not; results have −1.
    pub occluded: f64,
    /// Observation angle \[rad\].
    pub alpha_rad: f64,
    /// Box.
    pub bbox: BoundingBox,
    /// Height, width, length \[m\].
    pub size_hwl_m: [f64; 3],
    /// Bottom-face centre \[m\].
    pub location_m: [f64; 3],
    /// Rotation about camera y \[rad\].
    pub ry_rad: f64,
    /// Score of a result.
    pub score: Option<f64>,
}

/// Most objects in one frame. A file with more is no label file; pairs of objects are compared.
pub const MOST_IN_FRAME: usize = 1000;

/// Counts the objects of each frame of a file.
#[derive(Default)]
pub struct FrameCounts(BTreeMap<u64, usize>);

impl FrameCounts {
    /// Counts one more object in a frame.
    ///
    /// # Errors
    /// More than [`MOST_IN_FRAME`], naming the line.
    pub fn add(&mut self, frame: u64, row: &Row<'_>) -> Result<()> {
        let count = self.0.entry(frame).or_default();
        *count += 1;
        if *count > MOST_IN_FRAME {
            let expected = format!("at most {MOST_IN_FRAME} objects in a frame");
            return Err(row.error(expected, format!("one more in frame {frame}")));
        }
        Ok(())
    }
}

/// Reads a label file in the order of its lines, `DontCare` regions included.
///
/// # Errors
/// A line that does not read, or more than [`MOST_IN_FRAME`] objects in a frame.
pub fn read_labels(path: &Path) -> Result<Vec<Label>> {
    let file = TextFile::read(path)?;
    let mut counts = FrameCounts::default();
    let mut labels = Vec::new();
    for row in file.rows() {
        let label = label(&row)?;
        counts.add(label.frame, &row)?;
        labels.push(label);
    }
    Ok(labels)
}

fn label(row: &Row<'_>) -> Result<Label> {
    row.require_columns(&[17, 18], LAYOUT)?;
    Ok(Label {
        frame: row.parse(0, "a frame number")?,
        track: row.parse(1, "a track id")?,
        class: row.fields[2].to_owned(),
        truncated: row.number(3, "truncation")?,
        occluded: row.number(4, "occlusion")?,
        alpha_rad: row.number(5, "alpha")?,
        bbox: BoundingBox::new(row.numbers(6, "a box edge")?),
        size_hwl_m: row.numbers(10, "a size")?,
        location_m: row.numbers(13, "a coordinate")?,
        ry_rad: row.number(16, "ry")?,
        score: if row.fields.len() == 18 { Some(row.number(17, "a score")?) } else { None },
    })
}

impl Label {
    /// The line of a label or result file, without its end.
    pub fn to_line(&self) -> String {
        let numbers = |values: &[f64], digits: usize| {
            values.iter().map(|v| format!("{v:.digits$}")).collect::<Vec<_>>().join(" ")
        };
        let mut line = format!(
            "{} {} {} {} {} {:.6} {} {} {} {:.6}",
            self.frame,
            self.track,
            self.class,
            self.truncated,
            self.occluded,
            self.alpha_rad,
            numbers(&self.bbox.to_array(), 3),
            numbers(&self.size_hwl_m, 4),
            numbers(&self.location_m, 4),
            self.ry_rad
        );
        if let Some(score) = self.score {
            line.push_str(&format!(" {score:.4}"));
        }
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_round_trip_and_errors_name_line_and_column() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("0005.txt");
        let line = "3 7 Car 0 1 -1.5 10.5 20.25 110 95 1.5 1.6 3.9 -2.1 1.65 17.3 -1.57";
        std::fs::write(&path, format!("{line}\n{line} 0.93\n")).unwrap();
        let labels = read_labels(&path).unwrap();
        assert_eq!((labels[0].track, labels[0].bbox.y2, labels[0].location_m[2]), (7, 95.0, 17.3));
        assert_eq!((labels[0].score, labels[1].score), (None, Some(0.93)));
        std::fs::write(&path, labels[1].to_line()).unwrap();
        assert_eq!(read_labels(&path).unwrap(), labels[1..]);

        std::fs::write(&path, format!("{line}\n{}\n", line.replace("17.3", "far"))).unwrap();
        let error = read_labels(&path).unwrap_err();
        assert!(
            error.to_string().contains("0005.txt:2: expected a coordinate in column 16, found `far`"),
            "{error}"
        );
        assert_eq!(error.exit_code(), 3);
        std::fs::write(&path, "3 7 Car 0 1\n").unwrap();
        assert!(read_labels(&path).unwrap_err().to_string().contains("expected 17 or 18 columns"));
    }
}
