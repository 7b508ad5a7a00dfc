//! Sparse block algebra: ordering, symbolic analysis, supernodal Cholesky, selected inverse.

pub(crate) mod amd;
pub(crate) mod assembly;
pub(crate) mod cholesky;
mod dissection;
pub(crate) mod extend;
pub(crate) mod inverse;
pub(crate) mod matrix;
pub(crate) mod supernodes;
pub(crate) mod symbolic;
pub(crate) mod tree;

pub(crate) use assembly::PairSlots;
pub(crate) use cholesky::Cholesky;
pub(crate) use matrix::{BlockMatrix, Slot};
