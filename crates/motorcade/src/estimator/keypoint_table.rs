//! Keypoints of vehicles from a file.
//!
//! CSV with a header; columns are found by name: `frame`, `track_id`, `layout` (`car-36` or `car-14`, see
//! [`motorcade_shape::Layout`]), `index` within the layout, `x_px`, `y_px`, `confidence` (0 to 1). The track identity only
//! groups the points of one vehicle in a frame; boxes give the track.

use std::collections::BTreeMap;
use std::path::Path;

use motorcade_perception::VehicleKeypoints;
use motorcade_shape::{Layout, ObservedKeypoint};
use nalgebra::Point2;
use serde::Deserialize;

use crate::error::{Error, Result};

/// Keypoints by the input's own frame number.
#[derive(Clone, Debug, Default)]
pub struct KeypointTable {
    frames: BTreeMap<u64, Vec<VehicleKeypoints>>,
}

#[derive(Deserialize)]
struct Row {
    frame: u64,
    track_id: i64,
    layout: String,
    index: usize,
    x_px: f64,
    y_px: f64,
    confidence: f64,
}

impl KeypointTable {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that does not read, a missing column, an unknown layout, an index beyond it, a number that is none (file and
    /// line are named).
    pub fn read(path: &Path) -> Result<Self> {
        let expected = "expected columns frame, track_id, layout, index, x_px, y_px, confidence";
        let at = |line: u64, what: String| Error::Input(format!("{}:{line}: {what}", path.display()));
        let problem = |e: csv::Error| {
            let line = e.position().map_or(1, csv::Position::line);
            at(line, format!("{expected}: {e}"))
        };
        let mut sets: BTreeMap<(u64, i64), BTreeMap<usize, Vec<ObservedKeypoint>>> = BTreeMap::new();
        let mut reader = csv::Reader::from_path(path).map_err(problem)?;
        for (k, row) in reader.deserialize().enumerate() {
            let row: Row = row.map_err(problem)?;
            let line = k as u64 + 2;
            let Some(layout) = layout(&row.layout) else {
                return Err(at(line, format!("layout `{}`; expected car-36 or car-14", row.layout)));
            };
            let count = layout.count();
            if row.index >= count {
                return Err(at(
                    line,
                    format!("index {}; {} has keypoints 0 to {}", row.index, row.layout, count - 1),
                ));
            }
            if !(0.0..=1.0).contains(&row.confidence) || !(row.x_px + row.y_px).is_finite() {
                return Err(at(line, "expected finite pixels and a confidence from 0 to 1".to_owned()));
            }
            let nothing = ObservedKeypoint { pixel: Point2::origin(), confidence: 0.0 };
            let points = sets.entry((row.frame, row.track_id)).or_default().entry(count);
            points.or_insert_with(|| vec![nothing; count])[row.index] =
                ObservedKeypoint { pixel: Point2::new(row.x_px, row.y_px), confidence: row.confidence };
        }
        let mut table = Self::default();
        for ((frame, _), mut layouts) in sets {
            // Of a vehicle given in both layouts the one that says more.
            let Some((count, points)) = layouts.pop_last() else { continue };
            let layout = if count == Layout::Car36.count() { Layout::Car36 } else { Layout::Car14 };
            let keypoints = VehicleKeypoints::around_points(layout, points);
            table.frames.entry(frame).or_default().extend(keypoints);
        }
        Ok(table)
    }

    /// Keypoints of the frame with this number.
    pub fn of_frame(&self, number: u64) -> &[VehicleKeypoints] {
        self.frames.get(&number).map_or(&[], Vec::as_slice)
    }
}

fn layout(name: &str) -> Option<Layout> {
    match name {
        "car-36" => Some(Layout::Car36),
        "car-14" => Some(Layout::Car14),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<KeypointTable> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("keypoints.csv");
        std::fs::write(&path, text).unwrap();
        KeypointTable::read(&path)
    }

    const HEADER: &str = "frame,track_id,layout,index,name,x_px,y_px,confidence\n";

    #[test]
    fn points_of_a_vehicle_are_one_set() {
        let mut text = HEADER.to_owned();
        for (track, left) in [(1, 100.0), (2, 400.0)] {
            for (i, (x, y)) in [(0.0, 0.0), (80.0, 0.0), (80.0, 60.0), (0.0, 60.0)].into_iter().enumerate() {
                text += &format!("7,{track},car-14,{i},\"a, b\",{},{},0.8\n", left + x, 200.0 + y);
            }
        }
        let table = read(&text).unwrap();
        let [one, other] = table.of_frame(7) else { panic!("{table:?}") };
        assert_eq!((one.bbox.x1, other.bbox.x1, other.layout), (100.0, 400.0, Layout::Car14));
        assert_eq!(other.points.len(), 14);
        assert!(table.of_frame(8).is_empty());
    }

    #[test]
    fn problems_name_the_line() {
        let problem = |row: &str| read(&format!("{HEADER}{row}\n")).unwrap_err().to_string();
        assert!(problem("1,1,car-14,14,x,1,1,0.5").contains(":2: index 14"));
        assert!(problem("1,1,lorry,1,x,1,1,0.5").contains("expected car-36 or car-14"));
        assert!(problem("1,1,car-14,1,x,1,1,1.5").contains("confidence from 0 to 1"));
        assert!(problem("1,1,car-14,1,x,one,1,0.5").contains(":2"));
        assert!(read("frame,x\n1,2\n").unwrap_err().to_string().contains("x_px"));
    }
}
