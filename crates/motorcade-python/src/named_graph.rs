//! A pose graph whose vertices have the caller's numbers.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use motorcade_graph::factors::{Between, BetweenPlane, PoseResidual};
use motorcade_graph::g2o::{self, ReadOptions};
use motorcade_graph::solver::Control;
use motorcade_graph::start::{Start, descend, prepare};
use motorcade_graph::{Factor, Graph, Options, Report, Robust, RobustKernel, Solver, Value, VariableId};
use nalgebra::{Isometry2, Isometry3, Matrix3, Matrix4, Rotation2, Rotation3, UnitComplex, UnitQuaternion};

use crate::arrays::Square;
use crate::errors::Failure;

/// A pose graph whose vertices have numbers of the caller's.
#[derive(Default)]
pub struct NamedGraph {
    pub graph: Graph,
    pub vertices: BTreeMap<u64, VariableId>,
}

impl NamedGraph {
    /// Reads a g2o file.
    pub fn read(path: &Path, residual: PoseResidual, kernel: RobustKernel) -> Result<Self, Failure> {
        let document = g2o::read(path, &ReadOptions { residual, kernel })?;
        Ok(Self { graph: document.graph, vertices: document.vertices.into_iter().collect() })
    }

    /// The graph as a g2o file.
    pub fn text(&self) -> String {
        let ids: Vec<(u64, VariableId)> = self.vertices.iter().map(|(id, v)| (*id, *v)).collect();
        g2o::to_string(&self.graph, &ids)
    }

    pub fn variable(&self, id: u64) -> Result<VariableId, Failure> {
        self.vertices.get(&id).copied().ok_or_else(|| Failure::input(format!("there is no vertex {id}")))
    }

    pub fn add_vertex(&mut self, id: u64, pose: &Square, fixed: bool) -> Result<(), Failure> {
        if self.vertices.contains_key(&id) {
            return Err(Failure::input(format!("vertex {id} is there already")));
        }
        let value: Value = match pose {
            Square::Four(m) => space(m)?.into(),
            Square::Three(m) => plane(m)?.into(),
            Square::Six(_) => return Err(Failure::input("pose: expected 4×4 (SE(3)) or 3×3 (SE(2))")),
        };
        let variable = self.graph.add_variable(value);
        self.vertices.insert(id, variable);
        if fixed {
            self.graph.fix(variable)?;
        }
        Ok(())
    }

    pub fn add_edge(
        &mut self,
        [first, second]: [u64; 2],
        motion: &Square,
        information: &Square,
        kernel: RobustKernel,
        residual: PoseResidual,
    ) -> Result<(), Failure> {
        let (a, b) = (self.variable(first)?, self.variable(second)?);
        let factor: Box<dyn Factor> = match (motion, information) {
            (Square::Four(motion), Square::Six(information)) => {
                let edge = Between::new(a, b, space(motion)?, **information)?.with_residual(residual);
                Box::new(Robust::new(edge, kernel))
            }
            (Square::Three(motion), Square::Three(information)) => {
                Box::new(Robust::new(BetweenPlane::new(a, b, plane(motion)?, *information)?, kernel))
            }
            _ => {
                let expected =
                    "expected a motion of 4×4 with an information matrix of 6×6 (SE(3)), or both 3×3 (SE(2))";
                return Err(Failure::input(expected));
            }
        };
        self.graph.add_boxed(factor)?;
        Ok(())
    }

    /// True when a component has no fixed vertex.
    pub fn floats(&self) -> bool {
        self.graph.components().iter().any(|component| !component.iter().any(|v| self.graph.is_fixed(*v)))
    }

    /// Minimises the cost. A component without a fixed vertex is held at its first one meanwhile.
    pub fn optimise(&mut self, start: Start, options: Options, control: &Control) -> Result<Report, Failure> {
        options.validate()?;
        let began = Instant::now();
        let anchors = self.graph.anchor_components()?;
        let done = self.solve(start, &options, control, began);
        for anchor in anchors {
            self.graph.release(anchor);
        }
        done
    }

    fn solve(
        &mut self,
        start: Start,
        options: &Options,
        control: &Control,
        began: Instant,
    ) -> Result<Report, Failure> {
        if start == Start::Auto
            && let Some(report) = descend(&mut self.graph, &options.remaining(began), control)?
        {
            return Ok(report);
        }
        prepare(&mut self.graph, start, options, control, began)?;
        let solver = Solver::new(options.remaining(began))?;
        Ok(solver.with_control(control.clone()).optimise(&mut self.graph)?)
    }
}

/// Largest deviation of a rotation matrix from orthogonality.
const ORTHOGONAL: f64 = 1e-3;

fn space(m: &Matrix4<f64>) -> Result<Isometry3<f64>, Failure> {
    let rotation: Matrix3<f64> = m.fixed_view::<3, 3>(0, 0).into_owned();
    let off = (rotation * rotation.transpose() - Matrix3::identity()).norm();
    let last = [m[(3, 0)], m[(3, 1)], m[(3, 2)], m[(3, 3)] - 1.0];
    if off > ORTHOGONAL || rotation.determinant() < 0.0 || last.iter().any(|x| x.abs() > ORTHOGONAL) {
        return Err(Failure::input("a pose of 4×4 must be a rotation, a translation and the row 0 0 0 1"));
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Ok(Isometry3::from_parts(m.fixed_view::<3, 1>(0, 3).into_owned().into(), rotation))
}

fn plane(m: &Matrix3<f64>) -> Result<Isometry2<f64>, Failure> {
    let rotation = m.fixed_view::<2, 2>(0, 0).into_owned();
    let off = (rotation * rotation.transpose() - nalgebra::Matrix2::identity()).norm();
    let last = [m[(2, 0)], m[(2, 1)], m[(2, 2)] - 1.0];
    if off > ORTHOGONAL || rotation.determinant() < 0.0 || last.iter().any(|x| x.abs() > ORTHOGONAL) {
        return Err(Failure::input("a pose of 3×3 must be a rotation, a translation and the row 0 0 1"));
    }
    let rotation = UnitComplex::from_rotation_matrix(&Rotation2::from_matrix_unchecked(rotation));
    Ok(Isometry2::from_parts(m.fixed_view::<2, 1>(0, 2).into_owned().into(), rotation))
}
