//! Dense kernels of the sparse factorisation. All matrices are column-major.

mod factor;
mod lanes;
mod schur;
mod shape;
mod tile;
mod triangular;

pub(crate) use factor::factor_panel;
pub(crate) use schur::schur_complement;
pub(crate) use shape::Shape;
pub(crate) use triangular::{solve_backward, solve_forward};
