//! Keypoints of vehicles as CSV with a header: columns `frame`, `track_id`, `layout` (`car-36` or `car-14`, see
//! [`motorcade_shape::Layout`]), `index` within the layout, `x_px`, `y_px`, `confidence` (0 to 1), found by name. The track
//! identity only groups the points of one vehicle in a frame.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::Path;

use motorcade_dataset::text::LARGEST;
use motorcade_dataset::{Error as InputError, MOST_IN_FRAME, regular_file};
use motorcade_shape::{Layout, ObservedKeypoint};
use serde::Deserialize;

use crate::error::Result;
use crate::keypoints::VehicleKeypoints;

const COLUMNS: &str = "columns frame, track_id, layout, index, x_px, y_px, confidence";

/// Keypoints by the input's own frame number.
#[derive(Clone, Debug, Default)]
pub struct KeypointTable {
    by_frame: BTreeMap<u64, Vec<VehicleKeypoints>>,
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

/// Points of one vehicle in one frame, by the number of points of their layout.
type ByLayout = BTreeMap<usize, (Layout, Vec<ObservedKeypoint>)>;

impl KeypointTable {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that does not read, a missing column, an unknown layout, an index beyond it, a number out of range; file and line
    /// are named.
    pub fn read(path: &Path) -> Result<Self> {
        let at = |line: u64, expected: &str, found: String| InputError::Line {
            path: path.to_path_buf(),
            line: usize::try_from(line).unwrap_or(usize::MAX),
            expected: expected.to_owned(),
            found,
        };
        let problem = |e: csv::Error| at(e.position().map_or(1, csv::Position::line), COLUMNS, e.to_string());
        let mut vehicles: BTreeMap<(u64, i64), ByLayout> = BTreeMap::new();
        let mut in_frame: BTreeMap<u64, usize> = BTreeMap::new();
        let file =
            regular_file::open(path).map_err(|source| InputError::Io { path: path.to_path_buf(), source })?;
        let mut reader = csv::Reader::from_reader(file);
        for (k, row) in reader.deserialize().enumerate() {
            let row: Row = row.map_err(problem)?;
            let line = k as u64 + 2;
            let Some(layout) = layout(&row.layout) else {
                return Err(at(line, "layout car-36 or car-14", format!("`{}`", row.layout)).into());
            };
            let count = layout.count();
            if row.index >= count {
                let expected = format!("an index from 0 to {} of {}", count - 1, row.layout);
                return Err(at(line, &expected, row.index.to_string()).into());
            }
            if !(0.0..=1.0).contains(&row.confidence)
                || ![row.x_px, row.y_px].iter().all(|v| v.abs() <= LARGEST)
            {
                let found = format!("{} {} {}", row.x_px, row.y_px, row.confidence);
                return Err(at(line, "finite pixels and a confidence from 0 to 1", found).into());
            }
            if let Entry::Vacant(new) = vehicles.entry((row.frame, row.track_id)) {
                new.insert(ByLayout::new());
                let count = in_frame.entry(row.frame).or_insert(0);
                *count += 1;
                if *count > MOST_IN_FRAME {
                    let expected = format!("at most {MOST_IN_FRAME} vehicles in a frame");
                    return Err(at(line, &expected, format!("one more in frame {}", row.frame)).into());
                }
            }
            let points = vehicles.entry((row.frame, row.track_id)).or_default().entry(count);
            points.or_insert_with(|| (layout, vec![ObservedKeypoint::missing(); count])).1[row.index] =
                ObservedKeypoint::new([row.x_px, row.y_px].into(), row.confidence);
        }
        let mut table = Self::default();
        for ((frame, _), mut layouts) in vehicles {
            // Of a vehicle with keypoints in both layouts the larger layout counts.
            let Some((_, (layout, points))) = layouts.pop_last() else { continue };
            if let Some(keypoints) = VehicleKeypoints::around_points(layout, points) {
                table.by_frame.entry(frame).or_default().push(keypoints);
            }
        }
        Ok(table)
    }

    /// Keypoints of the vehicles in the frame with this number.
    pub fn of_frame(&self, number: u64) -> &[VehicleKeypoints] {
        self.by_frame.get(&number).map_or(&[], Vec::as_slice)
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
    fn points_of_a_vehicle_are_grouped() {
        let mut text = HEADER.to_owned();
        for (track, left) in [(1, 100.0), (2, 400.0)] {
            for (i, (x, y)) in [(0.0, 0.0), (80.0, 0.0), (80.0, 60.0), (0.0, 60.0)].into_iter().enumerate() {
                text += &format!("7,{track},car-14,{i},\"a, b\",{},{},0.8\n", left + x, 200.0 + y);
            }
        }
        let table = read(&text).unwrap();
        let [first, second] = table.of_frame(7) else { panic!("{table:?}") };
        assert_eq!((first.bbox.x1, second.bbox.x1, second.bbox.y2), (100.0, 400.0, 260.0));
        assert_eq!((second.layout, second.points.len()), (Layout::Car14, 14));
        assert!(table.of_frame(8).is_empty());
    }

    #[test]
    fn problems_name_the_line() {
        let problem = |row: &str| read(&format!("{HEADER}{row}\n")).unwrap_err().to_string();
        assert!(problem("1,1,car-14,14,x,1,1,0.5").contains(":2: expected an index from 0 to 13"));
        assert!(problem("1,1,lorry,1,x,1,1,0.5").contains("expected layout car-36 or car-14"));
        assert!(problem("1,1,car-14,1,x,1,1,1.5").contains("confidence from 0 to 1"));
        assert!(problem("1,1,car-14,1,x,one,1,0.5").contains(":2"));
        assert!(read("frame,x\n1,2\n").unwrap_err().to_string().contains("x_px"));
    }
}
