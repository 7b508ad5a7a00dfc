//! `models.toml`: what the networks of a folder expect and give.

use std::collections::BTreeMap;
use std::path::Path;

use motorcade_dataset::regular_file;

use crate::detection::VehicleClass;
use crate::error::{Error, Result};

/// Name of the manifest in a folder of networks.
pub const MANIFEST_NAME: &str = "models.toml";

/// Networks of a folder.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The networks; of several for one purpose the one that suits the image is taken.
    #[serde(rename = "model")]
    pub models: Vec<ModelEntry>,
}

/// One network.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelEntry {
    /// Name in reports.
    pub name: String,
    /// ONNX file beside the manifest.
    pub file: String,
    /// SHA-256 of the file in hexadecimal; checked when given.
    pub sha256: Option<String>,
    /// Licence of the weights.
    pub licence: String,
    /// Input.
    pub input: InputSpec,
    /// Output.
    pub output: OutputSpec,
}

/// Normalisation of pixels: `(pixel · scale − mean) / std` a channel, in the order of `colour`, laid out N C H W.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputSpec {
    /// Channel order.
    pub colour: ColourOrder,
    /// Resizing of the image to the input.
    pub resize: Resize,
    /// Factor on pixel values 0..255.
    #[serde(default = "one")]
    pub scale: f32,
    /// Subtracted after scaling, a channel.
    #[serde(default)]
    pub mean: [f32; 3],
    /// Divided by at the end, a channel.
    #[serde(default = "ones")]
    pub std: [f32; 3],
    /// Pixel value around a letterboxed image.
    #[serde(default = "grey")]
    pub pad: f32,
    /// Height and width \[px\] for networks that leave them open.
    pub size: Option<[usize; 2]>,
}

fn one() -> f32 {
    1.0
}
fn ones() -> [f32; 3] {
    [1.0; 3]
}
fn grey() -> f32 {
    114.0
}

/// Order of the colour channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ColourOrder {
    /// Red first.
    Rgb,
    /// Blue first.
    Bgr,
}

/// Resizing of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Resize {
    /// Same scale in both directions, at the top left, padded.
    Letterbox,
    /// Each direction on its own.
    Stretch,
}

/// Decoding of the output.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum OutputSpec {
    /// `[1, N, 5 + C]` over strides 8, 16, 32, not decoded: box, objectness, class probabilities.
    Yolox {
        /// Class numbers that are vehicles.
        classes: BTreeMap<String, VehicleClass>,
    },
    /// `[1, 1, N, 7]`, decoded: image, class, score, left, top, right, bottom in shares of the input.
    Ssd {
        /// Class numbers that are vehicles.
        classes: BTreeMap<String, VehicleClass>,
    },
    /// Three outputs: probabilities of box centres `[1, C, h, w]`, sizes `[1, 2, h, w]` and offsets `[1, 2, h, w]` in cells.
    #[serde(rename = "centre-point")]
    CentrePoint {
        /// Class numbers that are vehicles.
        classes: BTreeMap<String, VehicleClass>,
    },
    /// `[1, C, H, W]` class probabilities.
    Segmentation {
        /// Class numbers that are road.
        road: Vec<usize>,
    },
    /// Boxes by centre at strides 8 and 16 and the road at stride 4, in one pass (`training/README.md`).
    Scene {
        /// Pixels of the input, nearly; its shape follows the image.
        #[serde(default = "scene_pixels")]
        pixels: usize,
        /// False takes the boxes alone.
        #[serde(default = "yes")]
        road: bool,
        /// Mean errors of the edges of boxes, in order of height.
        #[serde(default)]
        edge_errors: Vec<EdgeErrors>,
    },
    /// Heat maps and visibilities of the 36 keypoints of `car-36`, in crops of 64×64 px (`training/README.md`).
    Keypoints {
        /// Accuracy of the points.
        #[serde(default)]
        variance: KeypointVariance,
        /// Weights of the sixth output, the presence of a vehicle in the box; without them it is not used.
        #[serde(default)]
        presence: Option<PresenceWeights>,
    },
}

/// Decoding of the boxes of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BoxFamily {
    /// One row a cell, not decoded (Ge et al., *YOLOX*, arXiv 2107.08430).
    Yolox,
    /// One row a box, decoded (Liu et al., *SSD*, ECCV 2016, with its detection-output layer).
    Ssd,
    /// Heat maps of box centres with sizes and offsets (Zhou et al., *Objects as Points*, arXiv 1904.07850).
    CentrePoint,
}

impl OutputSpec {
    /// Family and class numbers of a network whose only outputs are boxes.
    pub(crate) fn boxes(&self) -> Option<(BoxFamily, &BTreeMap<String, VehicleClass>)> {
        match self {
            Self::Yolox { classes } => Some((BoxFamily::Yolox, classes)),
            Self::Ssd { classes } => Some((BoxFamily::Ssd, classes)),
            Self::CentrePoint { classes } => Some((BoxFamily::CentrePoint, classes)),
            Self::Segmentation { .. } | Self::Scene { .. } | Self::Keypoints { .. } => None,
        }
    }
}

/// Mean errors of the edges of boxes of a height, in pixels of the input; positive to the right and down.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EdgeErrors {
    /// Height of the box as it is found.
    pub height: f64,
    /// Error of the left edge.
    #[serde(default)]
    pub left: f64,
    /// Error of the upper edge.
    #[serde(default)]
    pub top: f64,
    /// Error of the right edge.
    #[serde(default)]
    pub right: f64,
    /// Error of the lower edge.
    #[serde(default)]
    pub bottom: f64,
}

impl EdgeErrors {
    /// The errors (left, top, right, bottom) at a height, linear between those of a table in order of height: at smaller heights
    /// those of the first line, at greater ones those of the last.
    pub(crate) fn at(table: &[Self], height: f64) -> [f64; 4] {
        let errors = |e: &Self| [e.left, e.top, e.right, e.bottom];
        let above = table.partition_point(|e| e.height < height);
        match (above.checked_sub(1).map(|k| &table[k]), table.get(above)) {
            (None, None) => [0.0; 4],
            (Some(only), None) | (None, Some(only)) => errors(only),
            (Some(a), Some(b)) => {
                let part = (height - a.height) / (b.height - a.height);
                std::array::from_fn(|k| errors(a)[k] + part * (errors(b)[k] - errors(a)[k]))
            }
        }
    }

    fn is_valid(table: &[Self]) -> bool {
        let finite = |e: &Self| [e.height, e.left, e.top, e.right, e.bottom].iter().all(|v| v.is_finite());
        table.iter().all(finite) && table.windows(2).all(|pair| pair[0].height < pair[1].height)
    }
}

/// Variance of a keypoint along an axis: `gain` × second moment of its heat map + `floor`, in shares of the crop squared.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeypointVariance {
    /// Factor on the second moment.
    pub gain: f64,
    /// Variance of a point whose map is a single cell.
    pub floor: f64,
}

/// Log odds that a box shows a vehicle: `logit` × the network's output + `score` × the log odds of the box's score + `bias`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PresenceWeights {
    /// Weight of the network's logit.
    pub logit: f64,
    /// Weight of the log odds of the detector's score.
    pub score: f64,
    /// Constant.
    pub bias: f64,
}

impl Default for KeypointVariance {
    /// Two pixels of a crop of 64, whatever the map.
    fn default() -> Self {
        Self { gain: 0.0, floor: 1e-3 }
    }
}

fn yes() -> bool {
    true
}

/// 832 × 256: KITTI's images at two thirds.
fn scene_pixels() -> usize {
    832 * 256
}

/// Describes the development networks (YOLOX-Nano and road-segmentation-adas-0001, both Apache-2.0).
const BUILT_IN: &str = include_str!("builtin_models.toml");

impl Manifest {
    /// The manifest of a folder; without one, known file names are described by a built-in manifest.
    pub fn of_folder(folder: &Path) -> Result<Self> {
        let path = folder.join(MANIFEST_NAME);
        if path.is_file() {
            let text = regular_file::read_to_string(&path).map_err(|e| Error::model(&path, e.to_string()))?;
            return Self::parse(&path, &text);
        }
        if !folder.is_dir() {
            return Err(Error::model(folder, "no such folder of networks"));
        }
        let mut manifest = Self::parse(Path::new("built-in models.toml"), BUILT_IN)?;
        manifest.models.retain(|model| folder.join(&model.file).is_file());
        if manifest.models.is_empty() {
            return Err(Error::model(
                folder,
                format!(
                    "holds neither {MANIFEST_NAME} nor a network known by name; describe yours in {MANIFEST_NAME}"
                ),
            ));
        }
        Ok(manifest)
    }

    pub(crate) fn parse(path: &Path, text: &str) -> Result<Self> {
        let manifest: Self = toml::from_str(text).map_err(|e| Error::model(path, e.to_string()))?;
        for model in &manifest.models {
            let wrong = |problem: &str| Err(Error::model(path, format!("model {}: {problem}", model.name)));
            if model.input.std.contains(&0.0) {
                return wrong("std must not be 0");
            }
            if let Some((_, classes)) = model.output.boxes() {
                if classes.is_empty() {
                    return wrong("names no vehicle class");
                }
                if classes.keys().any(|key| key.parse::<usize>().is_err()) {
                    return wrong("the keys of classes are the class numbers of the network");
                }
            }
            match &model.output {
                OutputSpec::Segmentation { road } if road.is_empty() => return wrong("names no road class"),
                OutputSpec::Scene { pixels, .. } if !(10_000..=10_000_000).contains(pixels) => {
                    return wrong("pixels must lie between 10000 and 10000000");
                }
                OutputSpec::Scene { edge_errors, .. } if !EdgeErrors::is_valid(edge_errors) => {
                    return wrong("edge_errors must be numbers with increasing heights");
                }
                OutputSpec::Keypoints { variance: KeypointVariance { gain, floor }, .. }
                    if !(gain.is_finite() && *gain >= 0.0 && floor.is_finite() && *floor > 0.0) =>
                {
                    return wrong("variance needs a gain of 0 or more and a floor above 0");
                }
                OutputSpec::Keypoints { presence: Some(p), .. }
                    if ![p.logit, p.score, p.bias].iter().all(|weight| weight.is_finite()) =>
                {
                    return wrong("the weights of presence must be numbers");
                }
                _ => {}
            }
        }
        Ok(manifest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn the_built_in_manifest_reads() {
        let manifest = Manifest::parse(Path::new("built-in"), BUILT_IN).unwrap();
        assert_eq!(manifest.models.len(), 4);
        assert!(manifest.models.iter().all(|model| model.licence == "Apache-2.0"));
    }

    #[test]
    fn a_folder_without_networks_says_what_it_wants() {
        let folder = tempfile::tempdir().unwrap();
        let error = Manifest::of_folder(folder.path()).unwrap_err();
        assert!(error.to_string().contains("models.toml"), "{error}");
        std::fs::write(folder.path().join(MANIFEST_NAME), "[[model]]\nname = 3\n").unwrap();
        let error = Manifest::of_folder(folder.path()).unwrap_err();
        assert!(error.to_string().contains("line 2") && error.exit_code() == 3, "{error}");
    }

    /// A network of every kind with every key. A kind or a key that comes new does not compile here.
    fn all_keys() -> Manifest {
        let classes = || BTreeMap::from([("2".to_owned(), VehicleClass::Car)]);
        let errors = EdgeErrors { height: 1.0, left: 0.0, top: 0.0, right: 0.0, bottom: 0.0 };
        let presence = PresenceWeights { logit: 1.0, score: 1.0, bias: 0.0 };
        let outputs = [
            OutputSpec::Yolox { classes: classes() },
            OutputSpec::Ssd { classes: classes() },
            OutputSpec::CentrePoint { classes: classes() },
            OutputSpec::Segmentation { road: vec![1] },
            OutputSpec::Scene { pixels: 1, road: true, edge_errors: vec![errors] },
            OutputSpec::Keypoints { variance: KeypointVariance::default(), presence: Some(presence) },
        ];
        // Reminds of the list above.
        let known = |output: &OutputSpec| match output {
            OutputSpec::Yolox { .. }
            | OutputSpec::Ssd { .. }
            | OutputSpec::CentrePoint { .. }
            | OutputSpec::Segmentation { .. }
            | OutputSpec::Scene { .. }
            | OutputSpec::Keypoints { .. } => true,
        };
        assert!(outputs.iter().all(known));
        let entry = |output| ModelEntry {
            name: String::new(),
            file: String::new(),
            sha256: Some(String::new()),
            licence: String::new(),
            input: InputSpec {
                colour: ColourOrder::Bgr,
                resize: Resize::Letterbox,
                scale: 1.0,
                mean: [0.0; 3],
                std: [1.0; 3],
                pad: 114.0,
                size: Some([1, 1]),
            },
            output,
        };
        Manifest { models: outputs.map(entry).to_vec() }
    }

    /// Keys of tables but for the class numbers, and the names of the kinds.
    fn names(value: &toml::Value, out: &mut BTreeSet<String>) {
        match value {
            toml::Value::Array(all) => all.iter().for_each(|value| names(value, out)),
            toml::Value::Table(table) => {
                for (key, value) in table {
                    out.insert(key.clone());
                    match value {
                        toml::Value::String(kind) if key == "kind" => drop(out.insert(kind.clone())),
                        _ if key == "classes" => {}
                        value => names(value, out),
                    }
                }
            }
            _ => {}
        }
    }

    #[test]
    fn the_book_lists_every_key_and_kind() {
        let book = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/models.md");
        let book = std::fs::read_to_string(book).unwrap();
        // Text in backticks, and lines of the example.
        let code = book.split('`').skip(1).step_by(2).collect::<Vec<_>>().join("\n");
        let example = book.split("```toml").nth(1).unwrap();
        let text = format!("{code}\n{example}");
        let words: BTreeSet<&str> =
            text.split(|c: char| !(c.is_ascii_alphanumeric() || "_-".contains(c))).collect();
        let mut wanted = BTreeSet::new();
        names(&toml::Value::try_from(all_keys()).unwrap(), &mut wanted);
        assert!(wanted.len() > 25 && wanted.contains("centre-point"), "{wanted:?}");
        let missing: Vec<_> = wanted.iter().filter(|name| !words.contains(name.as_str())).collect();
        assert!(missing.is_empty(), "docs/src/models.md does not name {missing:?}");
    }
}
