//! The output of all detectors over a drive as a file: JSON lines, the first one with the detectors in words, then one a frame.
//! Read again it gives the same numbers, so that a run on it writes the same results.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::{GrayImage, ImageFormat};
use motorcade_dataset::{Error as InputError, MOST_IN_FRAME, regular_file};
use motorcade_shape::{HeadingEvidence, Layout, ObservedKeypoint};
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

use crate::detection::{BoundingBox, Detection};
use crate::error::{Error, Result};
use crate::keypoints::VehicleKeypoints;
use crate::observations::Observations;
use crate::recording::{Descriptions, Recording};
use crate::road::RoadMask;

/// Version of the format.
const VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
struct Header {
    /// [`VERSION`]; its name says the format.
    motorcade_perception: u32,
    #[serde(flatten)]
    detectors: Descriptions,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Line {
    frame: u64,
    detections: Vec<Detection>,
    road: Option<RoadLine>,
    keypoints: Vec<KeypointLine>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RoadLine {
    /// Width and height of the frame \[px\].
    image_size: (u32, u32),
    /// Probability of road, 0 to 255, as a grey PNG in base 64.
    png: String,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct KeypointLine {
    /// Number of points of the layout.
    layout: usize,
    bbox: BoundingBox,
    points: Vec<PointLine>,
    /// Probabilities of heading bins.
    heading: Option<Vec<f64>>,
    /// Log odds that the box shows a vehicle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    presence: Option<f64>,
}

/// x, y \[px\], confidence, and standard deviations along x and y \[px\] where known.
type PointLine = (f64, f64, f64, Option<(f64, f64)>);

/// Text of a recording's file that grows with the frames observed. Clones share it.
#[derive(Clone, Debug)]
pub struct KeptObservations(Arc<Mutex<String>>);

impl KeptObservations {
    pub(crate) fn new(detectors: &Descriptions) -> Self {
        let header = Header { motorcade_perception: VERSION, detectors: detectors.clone() };
        let text = serde_json::to_string(&header).unwrap_or_default() + "\n";
        Self(Arc::new(Mutex::new(text)))
    }

    /// Adds a frame.
    pub(crate) fn add(&self, number: u64, observations: &Observations) -> Result<()> {
        self.add_line(&Line::of(number, observations)?)
    }

    /// Adds the line of a frame.
    pub(crate) fn add_line(&self, line: &Line) -> Result<()> {
        let line = serde_json::to_string(line).map_err(|e| Error::Detector(Box::new(e)))?;
        let mut text = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        text.push_str(&line);
        text.push('\n');
        Ok(())
    }

    /// The text so far.
    pub fn text(&self) -> String {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Recording {
    /// Reads what [`KeptObservations`] gave.
    ///
    /// # Errors
    /// A file that does not read, is no recording, has a frame twice or values out of range; file and line are named.
    pub fn read(path: &Path) -> Result<Self> {
        let io = |source| InputError::Io { path: path.to_path_buf(), source };
        let file = regular_file::open(path).map_err(io)?;
        let mut recording: Option<Self> = None;
        for (k, line) in BufReader::new(file).lines().enumerate() {
            let line = line.map_err(io)?;
            let at = |found: String| problem(path, k + 1, found);
            match &mut recording {
                None => {
                    let header: Header = serde_json::from_str(&line).map_err(|e| at(e.to_string()))?;
                    if header.motorcade_perception != VERSION {
                        return Err(at(format!("version {}", header.motorcade_perception)));
                    }
                    recording = Some(Self::new(header.detectors));
                }
                Some(recording) => {
                    let line: Line = serde_json::from_str(&line).map_err(|e| at(e.to_string()))?;
                    let number = line.frame;
                    if !recording.insert(number, line.observations().map_err(at)?) {
                        return Err(at(format!("frame {number} a second time")));
                    }
                }
            }
        }
        recording.ok_or_else(|| problem(path, 1, "an empty file".into()))
    }
}

fn problem(path: &Path, line: usize, found: String) -> Error {
    let expected = format!("a recording of perception, version {VERSION}, as --keep-perception writes it");
    Error::Input(InputError::Line { path: PathBuf::from(path), line, expected, found })
}

impl Line {
    /// The line of a frame.
    pub(super) fn of(frame: u64, observations: &Observations) -> Result<Self> {
        let road = observations.road.as_ref().map(RoadLine::new).transpose()?;
        let keypoints = observations.keypoints.iter().map(KeypointLine::from).collect();
        Ok(Self { frame, detections: observations.detections.clone(), road, keypoints })
    }

    /// Number of the frame.
    pub(super) fn frame(&self) -> u64 {
        self.frame
    }

    /// Its boxes.
    pub(crate) fn detections(&self) -> &[Detection] {
        &self.detections
    }

    /// The output that the line holds, or what is wrong with it.
    pub(super) fn observations(self) -> std::result::Result<Observations, String> {
        if self.detections.len().max(self.keypoints.len()) > MOST_IN_FRAME {
            return Err(format!("more than {MOST_IN_FRAME} vehicles"));
        }
        for detection in &self.detections {
            if !detection.score.is_finite() || !is_box(&detection.bbox) {
                return Err("a box or score that is not finite".into());
            }
        }
        let road = self.road.map(RoadLine::mask).transpose()?;
        let keypoints = self.keypoints.into_iter().map(KeypointLine::keypoints).collect::<Option<_>>();
        let keypoints = keypoints.ok_or("keypoints out of range")?;
        Ok(Observations { detections: self.detections, road, keypoints })
    }
}

fn is_box(b: &BoundingBox) -> bool {
    [b.x1, b.y1, b.x2, b.y2].iter().all(|v| v.is_finite()) && b.x1 <= b.x2 && b.y1 <= b.y2
}

impl RoadLine {
    fn new(mask: &RoadMask) -> Result<Self> {
        let mut png = std::io::Cursor::new(Vec::new());
        let written = mask.probability_image().write_to(&mut png, ImageFormat::Png);
        written.map_err(|e| Error::Detector(Box::new(e)))?;
        Ok(Self { image_size: mask.image_size(), png: STANDARD.encode(png.into_inner()) })
    }

    fn mask(self) -> std::result::Result<RoadMask, String> {
        let (width, height) = self.image_size;
        let png = STANDARD.decode(&self.png).map_err(|e| format!("a road mask: {e}"))?;
        let image = image::load_from_memory_with_format(&png, ImageFormat::Png);
        let image: GrayImage = image.map_err(|e| format!("a road mask: {e}"))?.into_luma8();
        if width == 0 || height == 0 {
            return Err("a road mask of an empty frame".into());
        }
        Ok(RoadMask::new(image, width, height))
    }
}

impl From<&VehicleKeypoints> for KeypointLine {
    fn from(keypoints: &VehicleKeypoints) -> Self {
        let point = |p: &ObservedKeypoint| -> PointLine {
            (p.pixel.x, p.pixel.y, p.confidence, p.sigma_px.map(|s| (s.x, s.y)))
        };
        Self {
            layout: keypoints.layout.count(),
            bbox: keypoints.bbox,
            points: keypoints.points.iter().map(point).collect(),
            heading: keypoints.heading.as_ref().map(|h| h.bins().to_vec()),
            presence: keypoints.presence,
        }
    }
}

impl KeypointLine {
    /// `None` for values out of range.
    fn keypoints(self) -> Option<VehicleKeypoints> {
        let layout = [Layout::Car36, Layout::Car14].into_iter().find(|l| l.count() == self.layout)?;
        let point = |(x, y, confidence, sigma): PointLine| {
            let sigma_px = sigma.map(|(x, y)| Vector2::new(x, y));
            let valid = x.is_finite()
                && y.is_finite()
                && (0.0..=1.0).contains(&confidence)
                && sigma_px.is_none_or(|s| s.iter().all(|v| *v > 0.0 && v.is_finite()));
            valid.then(|| ObservedKeypoint { pixel: Point2::new(x, y), confidence, sigma_px })
        };
        let points: Vec<ObservedKeypoint> = self.points.into_iter().map(point).collect::<Option<_>>()?;
        let heading = match self.heading {
            Some(bins) => Some(HeadingEvidence::from_probabilities(bins)?),
            None => None,
        };
        let known = self.presence.is_none_or(f64::is_finite);
        let valid = points.len() == layout.count() && is_box(&self.bbox) && known;
        let Self { bbox, presence, .. } = self;
        valid.then_some(VehicleKeypoints { layout, points, bbox, heading, presence })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::{BoxConvention, VehicleClass};

    fn observations() -> Observations {
        let bbox = BoundingBox::new([0.1, 1.0 / 3.0, 100.0 * std::f64::consts::PI, 200.0]);
        let mut points = vec![ObservedKeypoint::missing(); 14];
        points[3] = ObservedKeypoint {
            pixel: Point2::new(2.0 / 3.0, 1e-7),
            confidence: 0.7,
            sigma_px: Some(Vector2::new(1.1, 2.3)),
        };
        let heading = HeadingEvidence::new(vec![0.1, 0.2, 0.3, 0.7, 0.123]);
        let mask = GrayImage::from_fn(16, 5, |x, y| image::Luma([(x * 16 + y) as u8]));
        Observations {
            detections: vec![Detection {
                class: VehicleClass::Van,
                score: 0.1 + 0.2,
                bbox,
                convention: BoxConvention::VisibleExtent,
                external_id: None,
                pixel_size: 1.0,
                road_below: None,
            }],
            road: Some(RoadMask::new(mask, 1242, 375)),
            keypoints: vec![VehicleKeypoints {
                layout: Layout::Car14,
                points,
                bbox,
                heading,
                presence: Some(-1.5),
            }],
        }
    }

    fn read(text: &str) -> Result<Recording> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("perception.jsonl");
        std::fs::write(&path, text).unwrap();
        Recording::read(&path)
    }

    #[test]
    fn what_is_read_is_what_was_kept() {
        let detectors = Descriptions { vehicles: Some("a \"network\"".into()), ..Default::default() };
        let kept = KeptObservations::new(&detectors);
        kept.add(7, &observations()).unwrap();
        kept.add(9, &Observations::default()).unwrap();
        let mut expected = Recording::new(detectors);
        assert!(expected.insert(7, observations()) && expected.insert(9, Observations::default()));
        assert_eq!(read(&kept.text()).unwrap(), expected);
    }

    #[test]
    fn damaged_files_are_named() {
        let kept = KeptObservations::new(&Descriptions::default());
        kept.add(7, &observations()).unwrap();
        let text = kept.text();
        let says = |text: &str, words: &str| {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains("perception.jsonl") && error.contains(words), "{error}");
        };
        says("", "empty");
        says("frame,x1\n", "jsonl:1");
        says(&text.replace("\"motorcade_perception\":1", "\"motorcade_perception\":2"), "version 2");
        says(&text[..text.len() / 2], "jsonl:2");
        let line = text.lines().nth(1).unwrap();
        says(&format!("{text}{line}\n"), "second time");
        says(&text.replace("iVBOR", "iVBOQ"), "road mask");
        says(&text.replace("0.7,[1.1", "1.7,[1.1"), "keypoints out of range");
    }
}
