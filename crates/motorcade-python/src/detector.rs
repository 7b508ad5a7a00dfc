//! A detector written in Python.

use motorcade_dataset::Frame;
use motorcade_perception::{
    BoundingBox, BoxConvention, Detection, Error, Result, VehicleClass, VehicleDetector,
};
use pyo3::prelude::*;

use crate::errors::InputError;
use crate::picture;

/// Calls a Python function with the picture; it gives boxes, names of classes and scores (`motorcade._detector.adapted`).
pub struct PythonDetector {
    detect: Py<PyAny>,
    description: String,
}

/// Boxes x1, y1, x2, y2 \[px\], classes, scores.
type Found = (Vec<[f64; 4]>, Vec<String>, Vec<f64>);

impl PythonDetector {
    pub fn new(detect: Py<PyAny>, description: String) -> Self {
        Self { detect, description }
    }

    fn call(&self, py: Python<'_>, frame: &Frame) -> PyResult<Vec<Detection>> {
        let wrong = |problem: String| {
            InputError::new_err(format!("frame {}: {}: {problem}", frame.number, self.description))
        };
        let found = self.detect.call1(py, (picture::array(py, &frame.pixels)?,))?;
        let (boxes, classes, scores): Found = found.extract(py)?;
        if boxes.len() != classes.len() || boxes.len() != scores.len() {
            let (b, c, s) = (boxes.len(), classes.len(), scores.len());
            return Err(wrong(format!("{b} boxes, {c} classes and {s} scores; expected as many of each")));
        }
        let mut detections = Vec::with_capacity(boxes.len());
        for ((edges, class), score) in boxes.into_iter().zip(classes).zip(scores) {
            let [x1, y1, x2, y2] = edges;
            if !edges.iter().chain([&score]).all(|x| x.is_finite()) || x2 <= x1 || y2 <= y1 {
                return Err(wrong(format!(
                    "box {edges:?} with score {score}; expected finite x1 < x2, y1 < y2"
                )));
            }
            let class = class.parse::<VehicleClass>().map_err(|e| wrong(e.to_string()))?;
            let (bbox, convention) = (BoundingBox::new(edges), BoxConvention::VisibleExtent);
            detections.push(Detection {
                class,
                score,
                bbox,
                convention,
                external_id: None,
                pixel_size: 1.0,
                road_below: None,
            });
        }
        Ok(detections)
    }
}

impl VehicleDetector for PythonDetector {
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
        // After an interruption the interpreter may end before the thread of the drive does.
        match Python::try_attach(|py| self.call(py, frame)) {
            Some(found) => found.map_err(|error| Error::Detector(Box::new(error))),
            None => Err(Error::Detector("the Python interpreter is ending".into())),
        }
    }
    fn description(&self) -> String {
        self.description.clone()
    }
}
