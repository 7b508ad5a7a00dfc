//! Detections as text: KITTI tracking labels, MOT Challenge, and the CSV of the RRC detector.

use std::collections::BTreeMap;
use std::path::Path;

use motorcade_dataset::text::{Row, TextFile};
use motorcade_dataset::{Frame, FrameCounts, read_labels};

use crate::detection::{BoundingBox, BoxConvention, Detection, VehicleClass};
use crate::detectors::VehicleDetector;
use crate::error::Result;

/// Layouts of detection files. Frame numbers are the input's own in all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DetectionFormat {
    /// 17 or 18 columns, space separated; track −1 means no identity. Boxes of labels (a 3D size, no score) are drawn around the
    /// corners of their 3D box, which is not looked at otherwise; those of results around what a detector saw.
    Kitti,
    /// `frame,id,x,y,width,height,confidence,..`, 7 to 10 columns; class 3 car, 5 motorcycle, −1 taken as car.
    Mot,
    /// `frame,x1,y1,x2,y2,score`.
    Rrc,
}

/// Detections of a whole drive.
#[derive(Clone, Debug, PartialEq)]
pub struct DetectionTable {
    format: DetectionFormat,
    by_frame: BTreeMap<u64, Vec<Detection>>,
}

impl DetectionTable {
    /// Reads a file; the layout follows from the separator and the number of columns of the first line.
    ///
    /// # Errors
    /// A line with a wrong column, named with its number.
    pub fn read(path: &Path) -> Result<Self> {
        let file = TextFile::read(path)?;
        let columns = file.comma_rows().next().map(|row| row.fields.len());
        let (format, rows) = match columns {
            None => (DetectionFormat::Kitti, Vec::new()),
            Some(1) => (DetectionFormat::Kitti, kitti(path)?),
            Some(7..=10) => (DetectionFormat::Mot, found(&file, mot)?),
            // Anything else with commas is held against the shortest layout, whose error names its columns.
            Some(_) => (DetectionFormat::Rrc, found(&file, rrc)?),
        };
        let mut by_frame: BTreeMap<u64, Vec<Detection>> = BTreeMap::new();
        for (frame, detection) in rows.into_iter().flatten() {
            by_frame.entry(frame).or_default().push(detection);
        }
        Ok(Self { format, by_frame })
    }

    /// The layout that was recognised.
    pub fn format(&self) -> DetectionFormat {
        self.format
    }
    /// Detections of the frame with this number, in the order of the file.
    pub fn of_frame(&self, number: u64) -> &[Detection] {
        self.by_frame.get(&number).map_or(&[], Vec::as_slice)
    }
    /// Frames with at least one detection.
    pub fn frames(&self) -> usize {
        self.by_frame.len()
    }
}

/// A row that speaks of a vehicle.
type Found = Option<(u64, Detection)>;

fn found(file: &TextFile, read: fn(&Row<'_>) -> Result<Found>) -> Result<Vec<Found>> {
    let (mut counts, mut rows) = (FrameCounts::default(), Vec::new());
    for row in file.comma_rows() {
        let found = read(&row)?;
        if let Some((frame, _)) = &found {
            counts.add(*frame, &row)?;
        }
        rows.push(found);
    }
    Ok(rows)
}

fn checked(row: &Row<'_>, bbox: [f64; 4]) -> Result<BoundingBox> {
    let bbox = BoundingBox::new(bbox);
    if bbox.width() > 0.0 && bbox.height() > 0.0 {
        return Ok(bbox);
    }
    Err(row.error("a box with x1 < x2 and y1 < y2", format!("{:?}", bbox.to_array())).into())
}

fn kitti(path: &Path) -> Result<Vec<Found>> {
    let vehicle = |label: motorcade_dataset::Label| {
        // Pedestrians, cyclists and DontCare regions stand in the same files.
        let class: VehicleClass = label.class.parse().ok()?;
        let bbox = label.bbox;
        let external_id = Some(label.track).filter(|track| *track >= 0);
        let is_label = label.score.is_none() && label.size_hwl_m.iter().all(|side| *side > 0.0);
        let convention = if is_label { BoxConvention::ProjectedCuboid } else { BoxConvention::VisibleExtent };
        let score = label.score.unwrap_or(1.0);
        Some((
            label.frame,
            Detection { class, score, bbox, convention, external_id, pixel_size: 1.0, road_below: None },
        ))
    };
    Ok(read_labels(path)?.into_iter().map(vehicle).collect())
}

fn mot(row: &Row<'_>) -> Result<Found> {
    row.require_columns(&[7, 8, 9, 10], "frame,id,x,y,width,height,confidence,class,visibility or x,y,z")?;
    let frame = row.parse(0, "a frame number")?;
    let id = row.number(1, "an id")? as i64;
    let [x, y, width, height] = row.numbers(2, "a box edge")?;
    let score = row.number(6, "a confidence")?;
    let class = match if row.fields.len() > 7 { row.number(7, "a class")? as i64 } else { -1 } {
        -1 | 3 => VehicleClass::Car,
        5 => VehicleClass::Motorcycle,
        _ => return Ok(None),
    };
    let bbox = checked(row, [x, y, x + width, y + height])?;
    let (convention, external_id) = (BoxConvention::VisibleExtent, Some(id).filter(|id| *id >= 0));
    Ok(Some((
        frame,
        Detection { class, score, bbox, convention, external_id, pixel_size: 1.0, road_below: None },
    )))
}

fn rrc(row: &Row<'_>) -> Result<Found> {
    row.require_columns(&[6], "frame,x1,y1,x2,y2,score")?;
    let frame = row.parse(0, "a frame number")?;
    let bbox = checked(row, row.numbers(1, "a box edge")?)?;
    let score = row.number(5, "a score")?;
    let (class, convention) = (VehicleClass::Car, BoxConvention::VisibleExtent);
    Ok(Some((
        frame,
        Detection { class, score, bbox, convention, external_id: None, pixel_size: 1.0, road_below: None },
    )))
}

impl VehicleDetector for DetectionTable {
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
        Ok(self.of_frame(frame.number).to_vec())
    }
    fn description(&self) -> String {
        format!("{:?} file", self.format)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<DetectionTable> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("d.txt");
        std::fs::write(&path, text).unwrap();
        DetectionTable::read(&path)
    }

    #[test]
    fn the_three_layouts_agree() {
        let rest = "-10 10 20 110 70 1.5 1.6 3.9 1 1.6 20 0";
        let kitti =
            read(&format!("3 7 Car 0 0 {rest} 0.9\n3 -1 DontCare -1 -1 {rest} 0\n4 -1 Van 0 0 {rest}\n"))
                .unwrap();
        let mot = read("3,7,10,20,100,50,0.9,-1,-1,-1\n4,-1,10,20,100,50,1,1,1\n").unwrap();
        let rrc = read("3,10,20,110,70,0.9\n").unwrap();
        assert_eq!(
            [kitti.format(), mot.format(), rrc.format()],
            [DetectionFormat::Kitti, DetectionFormat::Mot, DetectionFormat::Rrc]
        );
        assert_eq!(kitti.of_frame(3), mot.of_frame(3));
        assert_eq!(kitti.of_frame(3)[0].external_id, Some(7));
        assert_eq!(rrc.of_frame(3)[0].bbox, kitti.of_frame(3)[0].bbox);
        assert_eq!((kitti.of_frame(4)[0].class, kitti.of_frame(4)[0].external_id), (VehicleClass::Van, None));
        assert!(mot.of_frame(4).is_empty(), "a pedestrian");
        assert!(rrc.of_frame(99).is_empty());
    }

    #[test]
    fn boxes_of_labels_are_drawn_around_corners_and_those_of_results_around_what_is_seen() {
        let row = |size: &str, score: &str| {
            read(&format!("3 7 Car 0 0 -10 10 20 110 70 {size} 1 1.6 20 0{score}\n")).unwrap().of_frame(3)[0]
                .convention
        };
        assert_eq!(row("1.5 1.6 3.9", ""), BoxConvention::ProjectedCuboid);
        assert_eq!(row("1.5 1.6 3.9", " 0.9"), BoxConvention::VisibleExtent);
        assert_eq!(row("-1 -1 -1", ""), BoxConvention::VisibleExtent);
    }

    /// A million boxes in a frame would be compared with each other.
    #[test]
    fn more_boxes_than_a_picture_holds_are_refused_at_once() {
        let start = std::time::Instant::now();
        for line in [
            "3,10,20,110,70,0.9\n",
            "3,7,10,20,100,50,0.9,-1,-1,-1\n",
            "3 -1 Car -1 -1 -10 10 20 110 70 -1 -1 -1 -1 -1 -1 -1 0.9\n",
        ] {
            let error = read(&line.repeat(1_000_000)).unwrap_err().to_string();
            assert!(error.contains("d.txt:1001: expected at most 1000 objects in a frame"), "{error}");
        }
        assert!(start.elapsed().as_secs_f64() < 10.0, "three files");
        assert_eq!(read(&"3,10,20,110,70,0.9\n".repeat(1000)).unwrap().of_frame(3).len(), 1000);
    }

    #[test]
    fn wrong_columns_name_file_and_line() {
        for (text, expected) in [
            (
                "3,10,20,110,70,0.9\n4,10,20,110,wide,0.9\n",
                "d.txt:2: expected a box edge in column 5, found `wide`",
            ),
            ("3,10,20,110,70\n", "d.txt:1: expected 6 columns"),
            ("3,10,20,5,70,0.9\n", "d.txt:1: expected a box with x1 < x2"),
            ("3 7 Car 0 0\n", "d.txt:1: expected 17 or 18 columns"),
            ("3,10,20,1e300,70,0.9\n", "d.txt:1: expected a box edge in column 4 to be finite"),
            ("3,7,10,20,100,50,high,-1,-1,-1\n", "d.txt:1: expected a confidence in column 7"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.to_string().contains(expected) && error.exit_code() == 3, "{error}");
        }
    }
}
