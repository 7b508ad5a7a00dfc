//! Conversion, export and summary of shape priors, for command lines. Requests are plain structs, reports can be serialised;
//! nothing is printed.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::convert::{ConvertOptions, convert as convert_tables};
use crate::dimensions::Dimensions;
use crate::error::PriorError;
use crate::keypoint::Layout;
use crate::prior::ShapePrior;

/// Request of a conversion.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvertRequest {
    /// Table of the mean: a row of three coordinates per keypoint.
    pub mean: PathBuf,
    /// Table of the basis: a row per deformation.
    pub basis: PathBuf,
    /// JSON file the prior goes to.
    pub output: PathBuf,
    /// Layout, length, proportions.
    pub options: ConvertOptions,
}

/// Summary of a prior.
#[derive(Clone, Debug, Serialize)]
pub struct PriorReport {
    /// The JSON file.
    pub path: PathBuf,
    /// Name of the prior.
    pub name: String,
    /// Number of keypoints.
    pub keypoints: usize,
    /// Number of deformations.
    pub deformations: usize,
    /// Size of the mean.
    pub mean_size: Dimensions,
    /// Similarity-aligned RMS distance of the mean's keypoints from the built-in prior of the same layout \[m\]; none when
    /// no built-in layout has as many keypoints.
    pub rms_to_own_m: Option<f64>,
}

/// `shape convert`: tables to the text of a JSON file.
pub fn convert(request: &ConvertRequest) -> Result<(PriorReport, String), PriorError> {
    let prior = convert_tables(&request.mean, &request.basis, &request.options)?;
    Ok((report(&prior, &request.output), prior.to_json()))
}

/// `shape export`: the built-in prior as the text of a JSON file, as a start for others.
pub fn export(layout: Layout, output: &Path) -> (PriorReport, String) {
    let prior = ShapePrior::of_family(layout);
    (report(&prior, output), prior.to_json())
}

/// `shape info`: summary of a JSON file.
pub fn info(path: &Path) -> Result<PriorReport, PriorError> {
    Ok(report(&ShapePrior::read(path)?, path))
}

fn report(prior: &ShapePrior, path: &Path) -> PriorReport {
    let count = prior.keypoints().len();
    let own = [Layout::Car36, Layout::Car14].into_iter().find(|l| l.count() == count);
    let rms_to_own_m = own.and_then(|layout| ShapePrior::of_family(layout).rms_to(&prior.mean()[..count]));
    PriorReport {
        path: path.to_owned(),
        name: prior.name().to_owned(),
        keypoints: count,
        deformations: prior.basis().len(),
        mean_size: prior.dimensions(&[]),
        rms_to_own_m,
    }
}
