//! Reading `.g2o` files.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use motorcade_geometry::robust::RobustKernel;
use nalgebra::{
    DMatrixView, Isometry2, Isometry3, Matrix3, Matrix6, Quaternion, Translation3, UnitQuaternion, Vector2,
};
use serde::Serialize;

use super::convert::{angle_first, swap_halves};
use crate::GraphError;
use crate::factor::Factor;
use crate::factors::{Between, BetweenPlane, PoseResidual};
use crate::graph::Graph;
use crate::ids::VariableId;
use crate::information;
use crate::robust::Robust;

/// Options of reading.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReadOptions {
    /// Residual of SE(3) edges.
    pub residual: PoseResidual,
    /// Robust kernel of every edge.
    pub kernel: RobustKernel,
}

/// A graph with the ids of its file.
#[derive(Debug, Default)]
pub struct Document {
    /// Variables are numbered in the order of the file's ids, factors in the order of its edges.
    pub graph: Graph,
    /// File ids, increasing, with their variables.
    pub vertices: Vec<(u64, VariableId)>,
    /// Counts and repairs.
    pub summary: ReadSummary,
}

/// Counts and repairs of a file.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ReadSummary {
    /// SE(3) vertices.
    pub vertices_se3: usize,
    /// SE(2) vertices.
    pub vertices_se2: usize,
    /// SE(3) edges.
    pub edges_se3: usize,
    /// SE(2) edges.
    pub edges_se2: usize,
    /// Vertices fixed by `FIX`.
    pub fixed: usize,
    /// Indefinite information matrices, reduced to their positive part.
    pub clamped_information: usize,
    /// Smallest eigenvalue met, as a fraction of the largest of its matrix.
    pub worst_eigenvalue_ratio: f64,
    /// Tags that were kept out, with their counts.
    pub unknown_tags: BTreeMap<String, usize>,
}

impl Document {
    /// The variable of a file id.
    pub fn variable(&self, id: u64) -> Option<VariableId> {
        let at = self.vertices.binary_search_by_key(&id, |v| v.0).ok()?;
        Some(self.vertices[at].1)
    }
}

/// Largest number of a file: costs, which hold products of several, stay finite.
const LARGEST: f64 = 1e30;

/// Reads a file.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Document, GraphError> {
    // A FIFO or a device may never end.
    let text = std::fs::metadata(path).and_then(|found| match found.is_file() {
        true => std::fs::read_to_string(path),
        false => Err(io::Error::new(io::ErrorKind::InvalidInput, "is not a regular file")),
    });
    let text = text.map_err(|source| GraphError::Io { path: path.into(), source })?;
    let document = parse(&text, path, options)?;
    if document.vertices.is_empty() {
        let message = "holds no vertices that are known; expected a g2o file".to_owned();
        return Err(GraphError::Parse { path: path.into(), line: 1, message });
    }
    Ok(document)
}

#[derive(Debug)]
enum Edge {
    Space(Box<(Isometry3<f64>, Matrix6<f64>)>),
    Plane(Isometry2<f64>, Matrix3<f64>),
}

/// One line being read.
struct Line<'a> {
    path: &'a Path,
    number: usize,
}

impl Line<'_> {
    fn error(&self, message: impl Into<String>) -> GraphError {
        GraphError::Parse { path: PathBuf::from(self.path), line: self.number, message: message.into() }
    }

    fn ids<const N: usize>(&self, words: &mut std::str::SplitWhitespace<'_>) -> Result<[u64; N], GraphError> {
        let mut out = [0; N];
        for id in &mut out {
            let word = words.next().ok_or_else(|| self.error("an id is missing"))?;
            *id = word
                .parse()
                .map_err(|_| self.error(format!("{word:?} is not an id (a whole number from 0)")))?;
        }
        Ok(out)
    }

    fn numbers<const N: usize>(
        &self,
        words: &mut std::str::SplitWhitespace<'_>,
    ) -> Result<[f64; N], GraphError> {
        let mut out = [0.0; N];
        for (k, x) in out.iter_mut().enumerate() {
            let word = words.next().ok_or_else(|| self.error(format!("{N} numbers expected, found {k}")))?;
            *x = word.parse::<f64>().map_err(|_| self.error(format!("{word:?} is not a number")))?;
            // Not a number is within no bound.
            if x.is_nan() || x.abs() > LARGEST {
                return Err(
                    self.error(format!("{word} where a finite number of at most {LARGEST:e} is needed"))
                );
            }
        }
        Ok(out)
    }

    fn end(&self, words: &mut std::str::SplitWhitespace<'_>) -> Result<(), GraphError> {
        match words.next() {
            None => Ok(()),
            Some(word) if word.starts_with('#') => Ok(()),
            Some(word) => Err(self.error(format!("{word:?} is one number too many"))),
        }
    }

    fn pose(&self, x: &[f64; 7]) -> Result<Isometry3<f64>, GraphError> {
        let q = Quaternion::new(x[6], x[3], x[4], x[5]);
        if q.norm() < 1e-6 {
            return Err(self.error("the quaternion is zero"));
        }
        let rotation = UnitQuaternion::from_quaternion(q);
        Ok(Isometry3::from_parts(Translation3::new(x[0], x[1], x[2]), rotation))
    }
}

/// Symmetric matrix from the rows of its upper triangle.
fn upper<const N: usize>(x: &[f64]) -> [[f64; N]; N] {
    let (mut m, mut k) = ([[0.0; N]; N], 0);
    for i in 0..N {
        for j in i..N {
            m[i][j] = x[k];
            m[j][i] = x[k];
            k += 1;
        }
    }
    m
}

/// Content of the lines of a file, before ids are resolved.
#[derive(Default)]
struct Raw {
    vertices: BTreeMap<u64, (usize, crate::Value)>,
    edges: Vec<(usize, [u64; 2], Edge)>,
    fixed: Vec<(usize, u64)>,
    summary: ReadSummary,
}

impl Raw {
    fn line(&mut self, line: &Line<'_>, text: &str) -> Result<(), GraphError> {
        let words = &mut text.split_whitespace();
        match words.next() {
            None => return Ok(()),
            Some(tag) if tag.starts_with('#') => return Ok(()),
            Some("VERTEX_SE3:QUAT") => {
                let [id] = line.ids(words)?;
                let pose = line.pose(&line.numbers(words)?)?;
                self.summary.vertices_se3 += 1;
                self.vertex(line, id, pose.into())?;
            }
            Some("VERTEX_SE2") => {
                let [id] = line.ids(words)?;
                let [x, y, angle] = line.numbers(words)?;
                self.summary.vertices_se2 += 1;
                self.vertex(line, id, Isometry2::new(Vector2::new(x, y), angle).into())?;
            }
            Some("EDGE_SE3:QUAT") => {
                let ids = line.ids(words)?;
                let pose = line.pose(&line.numbers(words)?)?;
                let m = upper::<6>(&line.numbers::<21>(words)?);
                let m = swap_halves(&Matrix6::from_fn(|i, j| m[i][j]));
                self.summary.edges_se3 += 1;
                self.edges.push((line.number, ids, Edge::Space(Box::new((pose, m)))));
            }
            Some("EDGE_SE2") => {
                let ids = line.ids(words)?;
                let [x, y, angle] = line.numbers(words)?;
                let m = upper::<3>(&line.numbers::<6>(words)?);
                let m = angle_first(&Matrix3::from_fn(|i, j| m[i][j]));
                self.summary.edges_se2 += 1;
                let motion = Isometry2::new(Vector2::new(x, y), angle);
                self.edges.push((line.number, ids, Edge::Plane(motion, m)));
            }
            Some("FIX") => {
                for word in words.by_ref() {
                    let id = word.parse().map_err(|_| line.error(format!("{word:?} is not an id")))?;
                    self.fixed.push((line.number, id));
                }
            }
            Some(tag) => {
                *self.summary.unknown_tags.entry(tag.to_owned()).or_default() += 1;
                return Ok(());
            }
        }
        line.end(words)
    }

    fn vertex(&mut self, line: &Line<'_>, id: u64, value: crate::Value) -> Result<(), GraphError> {
        if let Some((first, _)) = self.vertices.insert(id, (line.number, value)) {
            return Err(line.error(format!("vertex {id} was given before, in line {first}")));
        }
        Ok(())
    }
}

/// Reads the text of a file; `path` only appears in errors.
pub fn parse(text: &str, path: &Path, options: &ReadOptions) -> Result<Document, GraphError> {
    let mut raw = Raw::default();
    for (k, text) in text.lines().enumerate() {
        raw.line(&Line { path, number: k + 1 }, text)?;
    }
    let mut out = Document { summary: raw.summary, ..Document::default() };
    for (id, (_, value)) in raw.vertices {
        let variable = out.graph.add_variable(value);
        out.vertices.push((id, variable));
    }
    for (number, ids, edge) in raw.edges {
        let line = Line { path, number };
        out.add_edge(&line, ids, edge, options)?;
    }
    for (number, id) in raw.fixed {
        let line = Line { path, number };
        let variable =
            out.variable(id).ok_or_else(|| line.error(format!("FIX names vertex {id}, which is nowhere")))?;
        out.graph.fix(variable)?;
    }
    out.summary.fixed = out.graph.fixed().len();
    Ok(out)
}

impl Document {
    fn add_edge(
        &mut self,
        line: &Line<'_>,
        ids: [u64; 2],
        edge: Edge,
        options: &ReadOptions,
    ) -> Result<(), GraphError> {
        let [a, b] = ids;
        let find = |id| {
            self.variable(id)
                .ok_or_else(|| line.error(format!("the edge names vertex {id}, which is nowhere")))
        };
        let (first, second) = (find(a)?, find(b)?);
        if a == b {
            return Err(line.error(format!("the edge joins vertex {a} with itself")));
        }
        let explain = |e: GraphError| line.error(e.to_string());
        let factor: Box<dyn Factor> = match edge {
            Edge::Space(parts) => {
                let (motion, mut m) = *parts;
                self.repair(m.as_mut_slice(), 6).map_err(explain)?;
                let factor = Between::new(first, second, motion, m).map_err(explain)?;
                wrap(factor.with_residual(options.residual), options)
            }
            Edge::Plane(motion, mut m) => {
                self.repair(m.as_mut_slice(), 3).map_err(explain)?;
                wrap(BetweenPlane::new(first, second, motion, m).map_err(explain)?, options)
            }
        };
        self.graph.add_boxed(factor).map_err(explain)?;
        Ok(())
    }

    /// Clamps an indefinite n×n matrix to its positive part and counts it. Refuses one without a positive part.
    fn repair(&mut self, m: &mut [f64], n: usize) -> Result<(), GraphError> {
        let view = DMatrixView::from_slice(m, n, n);
        let Some(repaired) = information::clamp(view) else { return Ok(()) };
        let eigenvalues = view.clone_owned().symmetric_eigenvalues();
        let ratio = eigenvalues.min() / eigenvalues.max();
        if eigenvalues.max() <= 0.0 {
            return Err(GraphError::Information(format!(
                "no eigenvalue is positive ({:e} to {:e})",
                eigenvalues.min(),
                eigenvalues.max()
            )));
        }
        self.summary.clamped_information += 1;
        self.summary.worst_eigenvalue_ratio = self.summary.worst_eigenvalue_ratio.min(ratio);
        m.copy_from_slice(repaired.as_slice());
        Ok(())
    }
}

fn wrap(factor: impl Factor + 'static, options: &ReadOptions) -> Box<dyn Factor> {
    match options.kernel {
        RobustKernel::None => Box::new(factor),
        kernel => Box::new(Robust::new(factor, kernel)),
    }
}
