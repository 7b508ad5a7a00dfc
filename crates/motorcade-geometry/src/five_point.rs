//! The five-point relative pose problem (Nistér 2004), solved by the action matrix of Stewénius et al. 2006.

use nalgebra::{DMatrix, Matrix3, SMatrix, SVector, Vector3};

/// Exponents of x, y, z in the 20 monomials up to degree 3, the 10 cubic-leading ones first (graded reverse lex).
const MONOMIALS: [[u8; 3]; 20] = [
    [3, 0, 0],
    [2, 1, 0],
    [1, 2, 0],
    [0, 3, 0],
    [2, 0, 1],
    [1, 1, 1],
    [0, 2, 1],
    [1, 0, 2],
    [0, 1, 2],
    [0, 0, 3],
    [2, 0, 0],
    [1, 1, 0],
    [0, 2, 0],
    [1, 0, 1],
    [0, 1, 1],
    [0, 0, 2],
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [0, 0, 0],
];

type Polynomial = [f64; 20];

fn index_of(exponents: [u8; 3]) -> usize {
    MONOMIALS.iter().position(|m| *m == exponents).unwrap_or(19)
}

/// Products of monomial indices, worked out once per solve (400 entries; only degree ≤ 3 is used).
fn product_table() -> [[u8; 20]; 20] {
    let mut table = [[u8::MAX; 20]; 20];
    for (i, a) in MONOMIALS.iter().enumerate() {
        for (j, b) in MONOMIALS.iter().enumerate() {
            let sum = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
            if sum.iter().sum::<u8>() <= 3 {
                table[i][j] = index_of(sum) as u8;
            }
        }
    }
    table
}

struct Algebra([[u8; 20]; 20]);

impl Algebra {
    fn multiply(&self, a: &Polynomial, b: &Polynomial) -> Polynomial {
        let mut out = [0.0; 20];
        for (i, x) in a.iter().enumerate().filter(|(_, x)| **x != 0.0) {
            for (j, y) in b.iter().enumerate().filter(|(_, y)| **y != 0.0) {
                out[usize::from(self.0[i][j]).min(19)] += x * y;
            }
        }
        out
    }
}

fn axpy(out: &mut Polynomial, factor: f64, a: &Polynomial) {
    for (o, v) in out.iter_mut().zip(a) {
        *o += factor * v;
    }
}

/// Reusable tables of the five-point solver.
pub struct FivePoint {
    algebra: Algebra,
}

impl Default for FivePoint {
    fn default() -> Self {
        Self { algebra: Algebra(product_table()) }
    }
}

impl FivePoint {
    /// Essential matrices E with `x_bᵀ E x_a = 0` for five pairs of rays (z = 1 or unit). At most ten, unit norm.
    pub fn solve(&self, rays: &[(Vector3<f64>, Vector3<f64>); 5]) -> Vec<Matrix3<f64>> {
        let Some(basis) = null_space(rays) else { return Vec::new() };
        let mut constraints = self.constraints(&basis);
        if !eliminate(&mut constraints) {
            return Vec::new();
        }
        // Action matrix of multiplication by x on the quotient basis {x², xy, y², xz, yz, z², x, y, z, 1}.
        let mut action = SMatrix::<f64, 10, 10>::zeros();
        for (row, cubic) in [0, 1, 2, 4, 5, 7].into_iter().enumerate() {
            for column in 0..10 {
                action[(row, column)] = -constraints[(cubic, 10 + column)];
            }
        }
        for (row, column) in [(6, 0), (7, 1), (8, 3), (9, 6)] {
            action[(row, column)] = 1.0;
        }
        let eigenvalues = action.complex_eigenvalues();
        let real = eigenvalues.iter().filter(|v| v.im.abs() < 1e-8 * (1.0 + v.re.abs()) && v.re.is_finite());
        real.filter_map(|value| {
            let monomials = null_vector(&(action - SMatrix::<f64, 10, 10>::identity() * value.re))?;
            let w = monomials[9];
            (w.abs() > 1e-12).then(|| {
                let (x, y, z) = (monomials[6] / w, monomials[7] / w, monomials[8] / w);
                let e = basis[0] * x + basis[1] * y + basis[2] * z + basis[3];
                e / e.norm()
            })
        })
        .collect()
    }

    /// The ten cubic constraints: det E = 0 and 2 E Eᵀ E − tr(E Eᵀ) E = 0.
    fn constraints(&self, basis: &[Matrix3<f64>; 4]) -> SMatrix<f64, 10, 20> {
        let entry = |r: usize, c: usize| {
            let mut p = [0.0; 20];
            (p[16], p[17], p[18], p[19]) =
                (basis[0][(r, c)], basis[1][(r, c)], basis[2][(r, c)], basis[3][(r, c)]);
            p
        };
        let e: [[Polynomial; 3]; 3] = std::array::from_fn(|r| std::array::from_fn(|c| entry(r, c)));
        let mul = |a: &Polynomial, b: &Polynomial| self.algebra.multiply(a, b);
        let mut eet = [[[0.0; 20]; 3]; 3];
        for r in 0..3 {
            for c in r..3 {
                for k in 0..3 {
                    axpy(&mut eet[r][c], 1.0, &mul(&e[r][k], &e[c][k]));
                }
                eet[c][r] = eet[r][c];
            }
        }
        let mut trace = [0.0; 20];
        (0..3).for_each(|k| axpy(&mut trace, 1.0, &eet[k][k]));
        let mut rows = Vec::with_capacity(10);
        let mut determinant = [0.0; 20];
        for (k, sign) in [(0, 1.0), (1, 1.0), (2, 1.0)] {
            let (a, b) = ((k + 1) % 3, (k + 2) % 3);
            let mut minor = mul(&e[1][a], &e[2][b]);
            axpy(&mut minor, -1.0, &mul(&e[1][b], &e[2][a]));
            axpy(&mut determinant, sign, &mul(&e[0][k], &minor));
        }
        rows.push(determinant);
        for r in 0..3 {
            for c in 0..3 {
                let mut p = [0.0; 20];
                for k in 0..3 {
                    axpy(&mut p, 2.0, &mul(&eet[r][k], &e[k][c]));
                }
                axpy(&mut p, -1.0, &mul(&trace, &e[r][c]));
                rows.push(p);
            }
        }
        SMatrix::from_fn(|r, c| rows[r][c])
    }
}

/// Four 3×3 matrices spanning the E with `x_bᵀ E x_a = 0`.
fn null_space(rays: &[(Vector3<f64>, Vector3<f64>); 5]) -> Option<[Matrix3<f64>; 4]> {
    let mut a = DMatrix::<f64>::zeros(9, 9);
    for (row, (p, q)) in rays.iter().enumerate() {
        for r in 0..3 {
            for c in 0..3 {
                a[(row, 3 * r + c)] = q[r] * p[c];
            }
        }
    }
    let vt = a.svd(false, true).v_t?;
    let matrix = |row: usize| Matrix3::from_fn(|r, c| vt[(row, 3 * r + c)]);
    Some([matrix(5), matrix(6), matrix(7), matrix(8)])
}

/// Gauss–Jordan on the first ten columns, with partial pivoting. False when singular.
fn eliminate(m: &mut SMatrix<f64, 10, 20>) -> bool {
    for pivot in 0..10 {
        let best =
            (pivot..10).max_by(|a, b| m[(*a, pivot)].abs().total_cmp(&m[(*b, pivot)].abs())).unwrap_or(pivot);
        if m[(best, pivot)].abs() < 1e-14 {
            return false;
        }
        m.swap_rows(pivot, best);
        let scale = 1.0 / m[(pivot, pivot)];
        for c in pivot..20 {
            m[(pivot, c)] *= scale;
        }
        for r in (0..10).filter(|r| *r != pivot) {
            let factor = m[(r, pivot)];
            if factor != 0.0 {
                for c in pivot..20 {
                    m[(r, c)] -= factor * m[(pivot, c)];
                }
            }
        }
    }
    true
}

/// A null vector of a singular 10×10 matrix by two steps of inverse iteration.
fn null_vector(m: &SMatrix<f64, 10, 10>) -> Option<SVector<f64, 10>> {
    let shifted = m + SMatrix::<f64, 10, 10>::identity() * (1e-10 * (1.0 + m.norm()));
    let lu = shifted.lu();
    let mut v = SVector::<f64, 10>::from_element(1.0);
    for _ in 0..3 {
        v = lu.solve(&v)?;
        let norm = v.norm();
        if !(norm.is_finite() && norm > 0.0) {
            return None;
        }
        v /= norm;
    }
    Some(v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lie::so3;

    #[test]
    fn finds_the_true_essential_matrix() {
        let rotation = so3::exp(&Vector3::new(0.02, -0.1, 0.01)).to_rotation_matrix().into_inner();
        let translation = Vector3::new(0.1, 0.02, -1.0);
        let truth = so3::hat(&translation) * rotation;
        let truth = truth / truth.norm();
        let points = [
            Vector3::new(-3.0, 1.0, 9.0),
            Vector3::new(2.0, -1.5, 14.0),
            Vector3::new(0.5, 1.6, 7.0),
            Vector3::new(5.0, -3.0, 22.0),
            Vector3::new(-6.0, 0.3, 17.0),
        ];
        let rays = points.map(|p| {
            (p / p.z, {
                let q = rotation * p + translation;
                q / q.z
            })
        });
        let found = FivePoint::default().solve(&rays);
        let best = found.iter().map(|e| (e - truth).norm().min((e + truth).norm())).fold(f64::MAX, f64::min);
        assert!(best < 1e-7, "best distance {best}, {} solutions", found.len());
    }
}
