//! Writing `.g2o` files.

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3};

use super::convert::{angle_last, swap_halves};
use crate::GraphError;
use crate::graph::Graph;
use crate::ids::VariableId;
use crate::manifold::Value;

/// Writes `graph` to `path`. `ids` gives the file's id of every variable to be written; variables without one and
/// factors that are no relative poses are left out. Numbers are written so that reading gives the same bits.
pub fn write(path: &Path, graph: &Graph, ids: &[(u64, VariableId)]) -> Result<(), GraphError> {
    let text = to_string(graph, ids);
    std::fs::write(path, text).map_err(|source| GraphError::Io { path: path.into(), source })
}

/// The text [`write()`] writes.
pub fn to_string(graph: &Graph, ids: &[(u64, VariableId)]) -> String {
    let mut by_variable: Vec<(VariableId, u64)> = ids.iter().map(|&(id, v)| (v, id)).collect();
    by_variable.sort_unstable();
    let file_id = |v: VariableId| {
        let at = by_variable.binary_search_by_key(&v, |p| p.0).ok()?;
        Some(by_variable[at].1)
    };
    let mut out = String::new();
    for &(id, variable) in ids {
        match graph.values().value(variable) {
            Ok(Value::Se3(pose)) => line(&mut out, format_args!("VERTEX_SE3:QUAT {id}"), &numbers(pose)),
            Ok(Value::Se2(pose)) => {
                let x = [pose.translation.x, pose.translation.y, pose.rotation.angle()];
                line(&mut out, format_args!("VERTEX_SE2 {id}"), &x);
            }
            _ => {}
        }
        if graph.is_fixed(variable) {
            line(&mut out, format_args!("FIX {id}"), &[]);
        }
    }
    for (_, factor) in graph.factors() {
        let [a, b] = factor.variables() else { continue };
        let (Some(a), Some(b)) = (file_id(*a), file_id(*b)) else { continue };
        if let Some(relative) = factor.relative_pose() {
            let information = swap_halves(relative.information);
            let mut x = numbers(relative.measurement).to_vec();
            x.extend((0..6).flat_map(|i| (i..6).map(move |j| (i, j))).map(|at| information[at]));
            line(&mut out, format_args!("EDGE_SE3:QUAT {a} {b}"), &x);
        } else if let Some(motion) = factor.relative_plane() {
            let m = factor.information();
            let information = angle_last(&Matrix3::from_fn(|i, j| m[(i, j)]));
            let mut x = vec![motion.translation.x, motion.translation.y, motion.rotation.angle()];
            x.extend((0..3).flat_map(|i| (i..3).map(move |j| (i, j))).map(|at| information[at]));
            line(&mut out, format_args!("EDGE_SE2 {a} {b}"), &x);
        }
    }
    out
}

fn numbers(pose: &Isometry3<f64>) -> [f64; 7] {
    let (t, q) = (pose.translation, pose.rotation);
    [t.x, t.y, t.z, q.i, q.j, q.k, q.w]
}

fn line(out: &mut String, head: std::fmt::Arguments<'_>, numbers: &[f64]) {
    // Writing to a string cannot fail.
    let _ = out.write_fmt(head);
    for x in numbers {
        let _ = write!(out, " {x}");
    }
    out.push('\n');
}
