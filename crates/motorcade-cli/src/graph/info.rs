//! `graph info`.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use serde::Serialize;

use crate::files::lossy;

use motorcade_graph::GraphError;
use motorcade_graph::Value;
use motorcade_graph::factors::PoseResidual;
use motorcade_graph::g2o::{self, ReadOptions, ReadSummary};

/// Contents of a file.
#[derive(Clone, Debug, Serialize)]
pub struct InfoReport {
    /// The file.
    #[serde(serialize_with = "lossy")]
    pub input: PathBuf,
    /// Counts, repaired matrices, unknown tags.
    pub read: ReadSummary,
    /// Connected components, the largest first.
    pub components: Vec<ComponentInfo>,
    /// Edges at a vertex: smallest, mean, largest.
    pub degree: (usize, f64, usize),
    /// Corners of the box around all positions \[m\].
    pub bounds_m: Option<([f64; 3], [f64; 3])>,
    /// Cost at the file's vertices with the logarithm as residual.
    pub cost_log: f64,
    /// The same with g2o's vector-quaternion residual.
    pub cost_mqt: f64,
}

/// One connected component.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ComponentInfo {
    /// Smallest id, which an optimisation would hold unless others are fixed.
    pub first_id: u64,
    /// Vertices.
    pub vertices: usize,
}

/// Describes a file.
pub fn info(input: &Path) -> Result<InfoReport, GraphError> {
    let read = |residual| g2o::read(input, &ReadOptions { residual, ..ReadOptions::default() });
    let document = read(PoseResidual::Log)?;
    let graph = &document.graph;
    let mut degrees = vec![0_usize; document.vertices.len()];
    for (_, factor) in graph.factors() {
        for variable in factor.variables() {
            // A document numbers its variables like its vertices.
            degrees[variable.index()] += 1;
        }
    }
    let positions: Vec<Vector3<f64>> = graph.values().iter().filter_map(|(_, v)| position(v)).collect();
    let corner = |start: f64, pick: fn(f64, f64) -> f64| {
        positions.iter().fold(Vector3::repeat(start), |a, b| a.zip_map(b, pick)).into()
    };
    let mut components: Vec<ComponentInfo> = graph
        .components()
        .iter()
        .filter_map(|c| {
            let first_id = document.vertices[c.first()?.index()].0;
            Some(ComponentInfo { first_id, vertices: c.len() })
        })
        .collect();
    components.sort_by_key(|c| (std::cmp::Reverse(c.vertices), c.first_id));
    let mean = degrees.iter().sum::<usize>() as f64 / degrees.len().max(1) as f64;
    let range = (degrees.iter().min().copied().unwrap_or(0), degrees.iter().max().copied().unwrap_or(0));
    Ok(InfoReport {
        input: input.into(),
        components,
        degree: (range.0, mean, range.1),
        bounds_m: (!positions.is_empty())
            .then(|| (corner(f64::INFINITY, f64::min), corner(f64::NEG_INFINITY, f64::max))),
        cost_log: graph.cost()?,
        cost_mqt: read(PoseResidual::Mqt)?.graph.cost()?,
        read: document.summary,
    })
}

/// Position of a vertex.
pub(super) fn position(value: &Value) -> Option<Vector3<f64>> {
    match value {
        Value::Se3(x) => Some(x.translation.vector),
        Value::Se2(x) => Some(Vector3::new(x.translation.x, x.translation.y, 0.0)),
        _ => None,
    }
}
