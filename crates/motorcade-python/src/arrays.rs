//! Poses and covariances as NumPy arrays.

use motorcade_geometry::Pose;
use nalgebra::{Matrix3, Matrix4, Matrix6};
use numpy::{PyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::errors::Failure;

/// A pose as a homogeneous matrix.
pub fn matrix<To, From>(pose: &Pose<To, From>) -> Matrix4<f64> {
    pose.isometry().to_homogeneous()
}

/// Numbers as an array of shape [n, N].
pub fn rows<'py, const N: usize>(
    py: Python<'py>,
    values: impl Iterator<Item = [f64; N]>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let values: Vec<f64> = values.flatten().collect();
    let n = values.len() / N;
    PyArray1::from_vec(py, values).reshape([n, N])
}

/// Square matrices as an array of shape [n, N, N].
pub fn stacked<'py, const N: usize>(
    py: Python<'py>,
    matrices: impl Iterator<Item = nalgebra::SMatrix<f64, N, N>>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let mut values = Vec::new();
    for matrix in matrices {
        // Columns of the transpose are rows.
        values.extend_from_slice(matrix.transpose().as_slice());
    }
    let n = values.len() / (N * N);
    PyArray1::from_vec(py, values).reshape([n, N, N])
}

/// A matrix as an array of shape [N, M].
pub fn single(py: Python<'_>, matrix: &nalgebra::DMatrix<f64>) -> PyResult<Py<PyArray2<f64>>> {
    let values = matrix.transpose().as_slice().to_vec();
    Ok(PyArray1::from_vec(py, values).reshape([matrix.nrows(), matrix.ncols()])?.unbind())
}

/// Poses as an array of shape [n, 4, 4].
pub fn poses<'py, To, From>(
    py: Python<'py>,
    poses: impl Iterator<Item = Pose<To, From>>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    stacked(py, poses.map(|pose| matrix(&pose)))
}

/// One pose as an array of shape [4, 4].
pub fn pose<'py, To, From>(py: Python<'py>, pose: &Pose<To, From>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    stacked(py, std::iter::once(matrix(pose)))?.reshape([4, 4])
}

/// One covariance as an array of shape [6, 6].
pub fn covariance<'py>(py: Python<'py>, matrix: &Matrix6<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    stacked(py, std::iter::once(*matrix))?.reshape([6, 6])
}

/// Numbers as an array of shape [n].
pub fn vector<T: numpy::Element>(
    py: Python<'_>,
    values: impl Iterator<Item = T>,
) -> Bound<'_, PyArray<T, numpy::Ix1>> {
    PyArray1::from_vec(py, values.collect())
}

/// A square matrix given by the caller.
pub enum Square {
    /// 3×3.
    Three(Matrix3<f64>),
    /// 4×4.
    Four(Matrix4<f64>),
    /// 6×6.
    Six(Box<Matrix6<f64>>),
}

impl Square {
    /// Reads an array of finite numbers.
    ///
    /// # Errors
    /// Another shape than 3×3, 4×4 or 6×6, numbers that are not finite.
    pub fn read(what: &str, array: &PyReadonlyArray2<'_, f64>) -> Result<Self, Failure> {
        let view = array.as_array();
        if view.iter().any(|x| !x.is_finite()) {
            return Err(Failure::input(format!("{what} holds NaN or infinity")));
        }
        let at = |r: usize, c: usize| view[[r, c]];
        Ok(match view.shape() {
            [3, 3] => Self::Three(Matrix3::from_fn(at)),
            [4, 4] => Self::Four(Matrix4::from_fn(at)),
            [6, 6] => Self::Six(Box::new(Matrix6::from_fn(at))),
            shape => {
                return Err(Failure::input(format!("{what} has shape {shape:?}; expected 3×3, 4×4 or 6×6")));
            }
        })
    }
}
