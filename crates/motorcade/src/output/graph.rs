//! `graph.g2o` and `graph.json`, which says what its numbers mean.

use std::io::Write;
use std::path::Path;

use motorcade_graph::{VariableId, g2o};
use serde_json::json;

use super::file;
use crate::error::Result;
use crate::result::RunResult;

pub(super) fn write(folder: &Path, result: &RunResult) -> Result<()> {
    let Some(multibody) = &result.graph else { return Ok(()) };
    if let Ok((poses, order)) = multibody.poses_alone() {
        let ids: Vec<(u64, VariableId)> = order.iter().enumerate().map(|(k, id)| (k as u64, *id)).collect();
        let text = g2o::to_string(&poses, &ids);
        // No reader takes NaN or infinity; the cost of such a graph is neither.
        if poses.cost().is_ok_and(f64::is_finite) {
            file(&folder.join("graph.g2o"), |out| out.write_all(text.as_bytes()))?;
        }
    }
    let nodes: Vec<_> =
        multibody.nodes().iter().enumerate().map(|(k, (node, _))| json!({"vertex": k, "is": node})).collect();
    let report = result.graph_report.as_ref().map(|r| {
        json!({
            "termination": format!("{:?}", r.termination),
            "iterations": r.iterations.len(),
            "initial_cost": r.initial_cost,
            "final_cost": r.final_cost,
            "unknowns": r.unknowns,
        })
    });
    let sidecar = json!({
        "vertices": nodes,
        "frames": "camera vertices are world_from_camera, vehicle vertices world_from_vehicle; metres",
        "left_out": "motion-model factors (steady motion, no side slip), sizes of vehicles (held where they are) and robust kernels have no form in g2o files",
        "variance_factors": multibody.variance_factors(),
        "optimisation": report,
    });
    file(&folder.join("graph.json"), |out| {
        writeln!(out, "{}", serde_json::to_string_pretty(&sidecar).unwrap_or_default())
    })
}
