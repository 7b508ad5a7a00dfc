//! `graph compare`.

use std::path::{Path, PathBuf};

use motorcade_geometry::lie::so3;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::Serialize;

use crate::files::lossy;

use motorcade_graph::GraphError;
use motorcade_graph::Value;
use motorcade_graph::factors::PoseResidual;
use motorcade_graph::g2o::{self, Document, ReadOptions};

/// Differences between two results.
#[derive(Clone, Debug, Serialize)]
pub struct CompareReport {
    /// First file: its edges define the costs.
    #[serde(serialize_with = "lossy")]
    pub first: PathBuf,
    /// Second file.
    #[serde(serialize_with = "lossy")]
    pub second: PathBuf,
    /// Vertices in both.
    pub common: usize,
    /// Vertices only in the first.
    pub only_first: usize,
    /// Vertices only in the second.
    pub only_second: usize,
    /// Differences as the files stand.
    pub raw: Differences,
    /// After the rigid motion that fits the positions best.
    pub aligned: Differences,
    /// Cost (log) of the first file's edges at its own vertices and at those of the second, where all are there.
    pub cost_log: (f64, Option<f64>),
    /// The same for g2o's residual.
    pub cost_mqt: (f64, Option<f64>),
}

/// Differences of poses.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Differences {
    /// Root mean square of the positions \[m\].
    pub position_rms_m: f64,
    /// Largest \[m\].
    pub position_max_m: f64,
    /// Root mean square of the rotation angles \[rad\].
    pub rotation_rms_rad: f64,
    /// Largest \[rad\].
    pub rotation_max_rad: f64,
}

/// Compares the vertices of two files and the cost of both under the edges of the first.
pub fn compare(first: &Path, second: &Path) -> Result<CompareReport, GraphError> {
    let read = |path: &Path, residual| g2o::read(path, &ReadOptions { residual, ..ReadOptions::default() });
    let mut log = read(first, PoseResidual::Log)?;
    let mut mqt = read(first, PoseResidual::Mqt)?;
    let other = read(second, PoseResidual::Log)?;
    let costs = (log.graph.cost()?, mqt.graph.cost()?);
    let mut pairs = Vec::new();
    for &(id, variable) in &log.vertices {
        if let Some(match_) = other.variable(id) {
            pairs
                .push((pose(log.graph.values().value(variable)?), pose(other.graph.values().value(match_)?)));
        }
    }
    let common = pairs.len();
    let complete = common == log.vertices.len();
    let mut at_other = (None, None);
    if complete {
        replace(&mut log, &other)?;
        replace(&mut mqt, &other)?;
        at_other = (Some(log.graph.cost()?), Some(mqt.graph.cost()?));
    }
    let raw = differences(&pairs);
    let align = alignment(&pairs);
    for (_, second) in &mut pairs {
        *second = align * *second;
    }
    Ok(CompareReport {
        first: first.into(),
        second: second.into(),
        common,
        only_first: log.vertices.len() - common,
        only_second: other.vertices.len() - common,
        raw,
        aligned: differences(&pairs),
        cost_log: (costs.0, at_other.0),
        cost_mqt: (costs.1, at_other.1),
    })
}

fn replace(document: &mut Document, other: &Document) -> Result<(), GraphError> {
    for k in 0..document.vertices.len() {
        let (id, variable) = document.vertices[k];
        if let Some(source) = other.variable(id) {
            let value = other.graph.values().value(source)?.clone();
            document.graph.values_mut().set(variable, value)?;
        }
    }
    Ok(())
}

/// Any vertex as a pose in space.
fn pose(value: &Value) -> Isometry3<f64> {
    let position = super::info::position(value).unwrap_or_else(Vector3::zeros);
    let rotation = match value {
        Value::Se3(x) => x.rotation,
        Value::Se2(x) => UnitQuaternion::from_axis_angle(&Vector3::z_axis(), x.rotation.angle()),
        _ => UnitQuaternion::identity(),
    };
    Isometry3::from_parts(Translation3::from(position), rotation)
}

fn differences(pairs: &[(Isometry3<f64>, Isometry3<f64>)]) -> Differences {
    let mut out = Differences::default();
    for (a, b) in pairs {
        let position = (a.translation.vector - b.translation.vector).norm();
        let rotation = a.rotation.angle_to(&b.rotation);
        out.position_rms_m += position * position;
        out.rotation_rms_rad += rotation * rotation;
        out.position_max_m = out.position_max_m.max(position);
        out.rotation_max_rad = out.rotation_max_rad.max(rotation);
    }
    let n = pairs.len().max(1) as f64;
    out.position_rms_m = (out.position_rms_m / n).sqrt();
    out.rotation_rms_rad = (out.rotation_rms_rad / n).sqrt();
    out
}

/// Rigid motion that brings the second positions nearest to the first (Umeyama without scale).
fn alignment(pairs: &[(Isometry3<f64>, Isometry3<f64>)]) -> Isometry3<f64> {
    let n = pairs.len().max(1) as f64;
    let mean = pairs.iter().fold((Vector3::zeros(), Vector3::zeros()), |m, (a, b)| {
        (m.0 + a.translation.vector / n, m.1 + b.translation.vector / n)
    });
    let mut covariance = Matrix3::zeros();
    for (a, b) in pairs {
        covariance += (a.translation.vector - mean.0) * (b.translation.vector - mean.1).transpose();
    }
    let rotation = Rotation3::from_matrix_unchecked(so3::nearest(&covariance));
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Isometry3::from_parts(Translation3::from(mean.0 - rotation * mean.1), rotation)
}
