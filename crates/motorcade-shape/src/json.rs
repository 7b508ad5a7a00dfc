//! Shape priors as JSON files.
//!
//! ```json
//! {
//!   "format": "motorcade-shape-prior",
//!   "version": 1,
//!   "name": "my car",
//!   "keypoints": [
//!     {"name": "front wheel centre, left", "mean_m": [1.3, 0.8, 0.3], "mirror": 1, "faces": [[0, 1, 0]]}
//!   ],
//!   "outline": [{"name": "nose, left", "mean_m": [2.1, 0.4, 0.5]}],
//!   "basis": [{"variance": 0.3, "displacements_m": [[0.1, 0, 0], [0.2, 0, 0]]}],
//!   "body_types": [{"body_type": "saloon", "coefficients": [0.7]}]
//! }
//! ```
//!
//! Vehicle frame: x forward, y left, z up, origin on the road below the body's centre, metres. `mirror` is the index of the
//! keypoint on the other side (its own when there is none), `faces` the outward unit directions of the faces the point lies
//! on; both, `outline` and `body_types` may be left out. `displacements_m` has a row for every keypoint, then for every
//! outline point. Unknown fields are refused.

use std::fs;
use std::io;
use std::path::Path;

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::body_type::BodyType;
use crate::error::PriorError;
use crate::keypoint::Keypoint;
use crate::prior::{Deformation, NamedShape, PriorParts, ShapePrior};

const FORMAT: &str = "motorcade-shape-prior";
const VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u32,
    name: String,
    keypoints: Vec<FileKeypoint>,
    #[serde(default)]
    outline: Vec<FilePoint>,
    basis: Vec<FileDeformation>,
    #[serde(default)]
    body_types: Vec<FileShape>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileKeypoint {
    name: String,
    mean_m: [f64; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mirror: Option<usize>,
    #[serde(default)]
    faces: Vec<[f64; 3]>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilePoint {
    name: String,
    mean_m: [f64; 3],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileDeformation {
    variance: f64,
    displacements_m: Vec<[f64; 3]>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileShape {
    body_type: BodyType,
    coefficients: Vec<f64>,
}

/// Reads a regular file; a FIFO or a device may never end.
pub(crate) fn read_text(path: &Path) -> Result<String, PriorError> {
    let regular = fs::metadata(path).and_then(|found| match found.is_file() {
        true => fs::read_to_string(path),
        false => Err(io::Error::new(io::ErrorKind::InvalidInput, "is not a regular file")),
    });
    regular.map_err(|source| PriorError::Io { path: path.to_owned(), source })
}

impl ShapePrior {
    /// Reads a JSON file (see the [format](crate::json)).
    pub fn read(path: &Path) -> Result<Self, PriorError> {
        let text = read_text(path)?;
        let file: File = serde_json::from_str(&text)
            .map_err(|source| PriorError::Json { path: path.to_owned(), source })?;
        file.into_prior(&path.display().to_string())
    }

    /// The JSON text of this prior. Bodies of body types are not part of it.
    pub fn to_json(&self) -> String {
        let array = |v: &Vector3<f64>| [v.x, v.y, v.z];
        let (keypoint_means, outline_means) = self.mean().split_at(self.keypoints().len());
        let file = File {
            format: FORMAT.to_owned(),
            version: VERSION,
            name: self.name().to_owned(),
            keypoints: self
                .keypoints()
                .iter()
                .zip(keypoint_means)
                .map(|(k, p)| FileKeypoint {
                    name: k.name.clone(),
                    mean_m: array(&p.coords),
                    mirror: Some(k.mirror),
                    faces: k.faces.iter().map(array).collect(),
                })
                .collect(),
            outline: self
                .outline()
                .iter()
                .zip(outline_means)
                .map(|(name, p)| FilePoint { name: name.clone(), mean_m: array(&p.coords) })
                .collect(),
            basis: self
                .basis()
                .iter()
                .map(|d| FileDeformation {
                    variance: d.variance,
                    displacements_m: d.displacements.iter().map(array).collect(),
                })
                .collect(),
            body_types: self
                .named_shapes()
                .iter()
                .map(|n| FileShape { body_type: n.body_type, coefficients: n.coefficients.clone() })
                .collect(),
        };
        // Finite numbers and strings always serialise.
        serde_json::to_string_pretty(&file).unwrap_or_default() + "\n"
    }
}

impl File {
    fn into_prior(self, origin: &str) -> Result<ShapePrior, PriorError> {
        let refuse = |field: &str, expected: String, found: String| {
            Err(PriorError::Field { origin: origin.to_owned(), field: field.to_owned(), expected, found })
        };
        if self.format != FORMAT {
            return refuse("format", format!("`{FORMAT}`"), format!("`{}`", self.format));
        }
        if self.version != VERSION {
            return refuse("version", VERSION.to_string(), self.version.to_string());
        }
        let point = |a: &[f64; 3]| Point3::from(*a);
        let means = self.keypoints.iter().map(|k| point(&k.mean_m));
        let mean = means.chain(self.outline.iter().map(|p| point(&p.mean_m))).collect();
        let keypoint = |(i, k): (usize, FileKeypoint)| Keypoint {
            name: k.name,
            mirror: k.mirror.unwrap_or(i),
            faces: k.faces.into_iter().map(Vector3::from).collect(),
        };
        let deformation = |d: FileDeformation| Deformation {
            variance: d.variance,
            displacements: d.displacements_m.into_iter().map(Vector3::from).collect(),
        };
        let shape = |s: FileShape| NamedShape {
            body_type: s.body_type,
            coefficients: s.coefficients,
            blueprint: None,
        };
        let parts = PriorParts {
            name: self.name,
            mean,
            keypoints: self.keypoints.into_iter().enumerate().map(keypoint).collect(),
            outline: self.outline.into_iter().map(|p| p.name).collect(),
            basis: self.basis.into_iter().map(deformation).collect(),
            named: self.body_types.into_iter().map(shape).collect(),
        };
        ShapePrior::new(parts, origin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Layout;

    fn read_text(text: &str) -> Result<ShapePrior, PriorError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("car.json");
        fs::write(&path, text).unwrap();
        ShapePrior::read(&path)
    }

    #[test]
    fn a_written_prior_reads_the_same() {
        let prior = ShapePrior::of_family(Layout::Car14);
        let again = read_text(&prior.to_json()).unwrap();
        assert_eq!((again.outline(), again.keypoints()), (prior.outline(), prior.keypoints()));
        assert_eq!(again.basis().len(), prior.basis().len());
        let van = prior.coefficients_of(BodyType::Van).unwrap();
        let pairs = again.points(again.coefficients_of(BodyType::Van).unwrap());
        // serde_json reads numbers to the last digit but one.
        assert!(pairs.iter().zip(prior.points(van)).all(|(p, q)| (p - q).norm() < 1e-12));
    }

    #[test]
    fn errors_name_file_field_and_what_was_expected() {
        let good = ShapePrior::of_family(Layout::Car14).to_json();
        let refused = |from: &str, to: &str| {
            assert!(good.contains(from), "{from}");
            read_text(&good.replacen(from, to, 1)).unwrap_err().to_string()
        };
        let cases = [
            ("\"version\": 1", "\"version\": 7", vec!["car.json", "version", "expected 1", "found 7"]),
            ("\"mirror\": 1", "\"mirror\": 99", vec!["keypoints[0].mirror", "found 99"]),
            ("\"mirror\": 1", "\"mirorr\": 1", vec!["unknown field `mirorr`", "line"]),
            ("\"variance\": ", "\"variance\": -", vec!["basis[0].variance", "a positive number"]),
            ("\"name\"", "\"nom\"", vec!["unknown field `nom`"]),
            ("\"format\": \"motorcade", "\"format\": \"other", vec!["format", "`motorcade-shape-prior`"]),
            ("\"body_type\": \"city\"", "\"body_type\": \"citi\"", vec!["citi", "hatchback"]),
        ];
        for (from, to, words) in cases {
            let message = refused(from, to);
            for word in words {
                assert!(message.contains(word), "{from}: {message}");
            }
        }
        let absent = ShapePrior::read(Path::new("nowhere/car.json")).unwrap_err();
        assert!(absent.to_string().starts_with("nowhere/car.json: "), "{absent}");
    }
}
