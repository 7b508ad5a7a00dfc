//! Algebra of symmetric positive definite block-sparse matrices: the normal equations of least squares.
//!
//! A [`BlockMatrix`] holds `H` and a right-hand side over a fixed block pattern. Approximate minimum degree or nested
//! dissection orders it, columns of nearly equal structure form supernodes, and [`Cholesky`] eliminates them
//! multifrontally with dense kernels; all but the numbers is done once. [`SelectedInverse`] gives the blocks of `H⁻¹`.
//! Results are the same, bit for bit, for any number of threads.
//!
//! [`simd`] builds one kernel for several kinds of vector registers; it holds the only `unsafe` code of the workspace.
//!
//! ```
//! use motorcade_sparse::{BlockMatrix, Cholesky, SelectedInverse, Stop};
//!
//! // Two blocks of one scalar: H = [[4, 2], [2, 3]], b = [2, 5].
//! let mut h = BlockMatrix::new(&[1, 1], &[(0, 1)]);
//! for (i, j, x) in [(0, 0, 4.0), (1, 0, 2.0), (1, 1, 3.0)] {
//!     if let Some(slot) = h.slot(i, j) {
//!         h.add(slot, 1.0, &[x], 1, (1, 1));
//!     }
//! }
//! h.add_rhs(0, 1.0, &[2.0]);
//! h.add_rhs(1, 1.0, &[5.0]);
//! let mut factor = Cholesky::default();
//! factor.factorise(&h, 0.0, false, None, Stop::NEVER)?;
//! let mut x = h.rhs.clone();
//! factor.solve(&h, &mut x);
//! assert!((x[h.range(0).start] + 0.5).abs() < 1e-12 && (x[h.range(1).start] - 2.0).abs() < 1e-12);
//! let Some(inverse) = SelectedInverse::new(&h, &factor, Stop::NEVER) else { return Ok(()) };
//! assert!((inverse.block(&h, &factor, 0, 0)[(0, 0)] - 0.375).abs() < 1e-12);
//! # Ok::<(), motorcade_sparse::Unfactorised>(())
//! ```

mod amd;
mod assembly;
mod cholesky;
mod dense;
mod dissection;
mod extend;
mod inverse;
mod matrix;
mod memory;
pub mod simd;
mod slot;
mod stop;
mod supernodes;
mod symbolic;
mod tree;
mod unfactorised;

pub use assembly::PairSlots;
pub use cholesky::Cholesky;
pub use inverse::SelectedInverse;
pub use matrix::BlockMatrix;
pub use slot::Slot;
pub use stop::Stop;
pub use symbolic::Ordering;
pub use unfactorised::Unfactorised;
