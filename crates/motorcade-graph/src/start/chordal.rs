//! Chordal relaxation: rotations, then positions, each by one linear solve.
//!
//! Martinec and Pajdla, *Robust rotation and translation estimation*, CVPR 2007; Carlone et al., *Initialization
//! techniques for 3D SLAM*, ICRA 2015. Dropping the constraint RᵀR = I from `Σ κ‖R_j − R_i R_ij‖²` leaves a linear
//! problem; its three rows share one matrix with 3×3 blocks.

use motorcade_geometry::lie::so3;
use motorcade_sparse::{BlockMatrix, Cholesky, Stop};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::edges::{Edge, PoseNetwork};
use crate::GraphError;
use crate::graph::Graph;

/// Sets every SE(3) variable that is not fixed to the chordal solution of the graph's relative poses, in the frame
/// of the fixed ones (or of the first of each component). Robust kernels are ignored.
pub fn chordal(graph: &mut Graph) -> Result<(), GraphError> {
    chordal_unless(graph, Stop::NEVER)
}

/// The same, given up with [`GraphError::Stopped`] when asked to; the values are then as before.
pub(super) fn chordal_unless(graph: &mut Graph, stop: Stop<'_>) -> Result<(), GraphError> {
    let mut network = PoseNetwork::new(graph);
    let mut system = System::new(&network);
    if system.free.is_empty() {
        return Ok(());
    }
    let rotations = system.rotations(&network, stop)?;
    for (&k, rotation) in system.free.iter().zip(rotations) {
        network.poses[k as usize].rotation = rotation;
    }
    let positions = system.positions(&network, stop)?;
    for (&k, position) in system.free.iter().zip(positions) {
        network.poses[k as usize].translation.vector = position;
        let id = network.variables[k as usize];
        if !graph.is_fixed(id) {
            graph.values_mut().set(id, network.poses[k as usize])?;
        }
    }
    Ok(())
}

/// A linear system with one 3-vector for each pose that is not an anchor.
struct System {
    /// Poses by block.
    free: Vec<u32>,
    /// Blocks by pose.
    block: Vec<Option<u32>>,
    matrix: BlockMatrix,
    factor: Cholesky,
}

impl System {
    fn new(network: &PoseNetwork) -> Self {
        let (mut free, mut block) = (Vec::new(), vec![None; network.poses.len()]);
        for k in 0..network.poses.len() {
            if !network.anchored[k] {
                block[k] = Some(free.len() as u32);
                free.push(k as u32);
            }
        }
        let ends = |e: &Edge| Some((block[e.first as usize]?, block[e.second as usize]?));
        let pairs: Vec<_> = network.edges.iter().filter_map(ends).collect();
        let matrix = BlockMatrix::new(&vec![3; free.len()], &pairs);
        Self { free, block, matrix, factor: Cholesky::default() }
    }

    fn add(&mut self, i: Option<u32>, j: Option<u32>, m: &Matrix3<f64>) {
        let (Some(i), Some(j)) = (i, j) else { return };
        if let Some(slot) = self.matrix.slot(i, j) {
            self.matrix.add(slot, 1.0, m.as_slice(), 3, (3, 3));
        }
    }

    fn factorise(&mut self, stop: Stop<'_>) -> Result<(), GraphError> {
        self.factor.factorise(&self.matrix, 0.0, false, None, stop).map_err(GraphError::unfactorised)
    }

    fn solve(&mut self, right: &mut [f64]) -> Vec<Vector3<f64>> {
        self.factor.solve(&self.matrix, right);
        let vector = |b| Vector3::from_column_slice(&right[self.matrix.range(b)]);
        (0..self.free.len() as u32).map(vector).collect()
    }

    /// With x_i a row of R_i as a column: minimise `Σ κ‖x_j − R_ijᵀ x_i‖²` for each of the three rows.
    fn rotations(
        &mut self,
        network: &PoseNetwork,
        stop: Stop<'_>,
    ) -> Result<Vec<UnitQuaternion<f64>>, GraphError> {
        self.matrix.clear();
        let mut right = vec![vec![0.0; self.matrix.len()]; 3];
        for edge in &network.edges {
            let (first, second) = (edge.first as usize, edge.second as usize);
            let (i, j) = (self.block[first], self.block[second]);
            let kappa = (edge.information.fixed_view::<3, 3>(0, 0).trace() / 3.0).max(1e-9);
            let r = edge.motion.rotation.to_rotation_matrix().into_inner();
            self.add(i, i, &(Matrix3::identity() * kappa));
            self.add(j, j, &(Matrix3::identity() * kappa));
            self.add(j, i, &(-kappa * r.transpose()));
            for (known, unknown, m) in [(first, j, r.transpose()), (second, i, r)] {
                let Some(b) = unknown.filter(|_| self.block[known].is_none()) else { continue };
                let rows = network.poses[known].rotation.to_rotation_matrix().into_inner();
                for (k, right) in right.iter_mut().enumerate() {
                    let x = m * rows.row(k).transpose() * kappa;
                    for (target, x) in right[self.matrix.range(b)].iter_mut().zip(x.iter()) {
                        *target += x;
                    }
                }
            }
        }
        self.factorise(stop)?;
        let rows: Vec<Vec<Vector3<f64>>> = right.iter_mut().map(|r| self.solve(r)).collect();
        let nearest = |k: usize| {
            let m =
                Matrix3::from_rows(&[rows[0][k].transpose(), rows[1][k].transpose(), rows[2][k].transpose()]);
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(so3::nearest(&m)))
        };
        Ok((0..self.free.len()).map(nearest).collect())
    }

    /// Rotations known: minimise `Σ ‖t_j − t_i − R_i t_ij‖²` in the metric of each edge's information.
    fn positions(&mut self, network: &PoseNetwork, stop: Stop<'_>) -> Result<Vec<Vector3<f64>>, GraphError> {
        self.matrix.clear();
        let mut right = vec![0.0; self.matrix.len()];
        for edge in &network.edges {
            let (first, second) = (edge.first as usize, edge.second as usize);
            let (i, j) = (self.block[first], self.block[second]);
            let rotation = network.poses[first].rotation;
            let turned = (rotation * edge.motion.rotation).to_rotation_matrix().into_inner();
            let own = edge.information.fixed_view::<3, 3>(3, 3).into_owned();
            let scale = own.trace().max(1e-9);
            let m = turned * (own + Matrix3::identity() * (1e-9 * scale)) * turned.transpose();
            self.add(i, i, &m);
            self.add(j, j, &m);
            self.add(j, i, &-m);
            let shift = rotation * edge.motion.translation.vector;
            let at = |k: usize| match self.block[k] {
                Some(_) => Vector3::zeros(),
                None => network.poses[k].translation.vector,
            };
            let (for_second, for_first) = (m * (shift + at(first)), m * (at(second) - shift));
            for (b, x) in [(j, for_second), (i, for_first)] {
                let Some(b) = b else { continue };
                for (target, x) in right[self.matrix.range(b)].iter_mut().zip(x.iter()) {
                    *target += x;
                }
            }
        }
        self.factorise(stop)?;
        Ok(self.solve(&mut right))
    }
}
