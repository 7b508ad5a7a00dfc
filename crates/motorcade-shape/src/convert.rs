//! Priors published as two tables of numbers, brought into the vehicle frame and into metres.
//!
//! The tables: the mean, a row of three coordinates per keypoint; the basis, a row per deformation of three numbers per keypoint.
//! Their unit is arbitrary, and they have neither variances of the deformations nor the road. These follow from the built-in
//! [family](crate::FAMILY): the scale from a length, the road from the tyres, the variances from the family's cars along the
//! deformations.

use std::path::Path;

use nalgebra::{Matrix3, Point3, Vector3};

use crate::error::PriorError;
use crate::keypoint::Layout;
use crate::prior::{Deformation, NamedShape, PriorParts, ShapePrior};
use crate::table;

/// Conversion of the tables' unit to metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Proportions {
    /// One factor: the published proportions stay.
    Kept,
    /// A factor an axis, so that length, width and height of the keypoints are in the proportions of our own mean.
    Own,
    /// `Kept` for 36 keypoints, `Own` for 14, whose published table is squeezed lengthwise.
    #[default]
    ByLayout,
}

/// Options of [`convert`].
#[derive(Clone, Debug, PartialEq)]
pub struct ConvertOptions {
    /// The order of keypoints and the axes of the tables.
    ///
    /// `Car36`: x forward, y up, z to the right. `Car14`: x to the left, y backward, z up.
    pub layout: Layout,
    /// Bumper to bumper length the mean is scaled to \[m\].
    pub length_m: f64,
    /// One factor or three.
    pub proportions: Proportions,
}

impl ConvertOptions {
    /// A car of 4.1 m.
    pub fn new(layout: Layout) -> Self {
        Self { layout, length_m: 4.1, proportions: Proportions::default() }
    }
}

/// Reads the tables of a mean and a basis as a prior.
pub fn convert(mean: &Path, basis: &Path, options: &ConvertOptions) -> Result<ShapePrior, PriorError> {
    let refuse = |path: &Path, field: &str, expected: String, found: String| PriorError::Field {
        origin: path.display().to_string(),
        field: field.to_owned(),
        expected,
        found,
    };
    if !(options.length_m > 0.5 && options.length_m < 30.0) {
        let found = options.length_m.to_string();
        return Err(refuse(mean, "length", "metres between 0.5 and 30".into(), found));
    }
    let count = options.layout.count();
    let mean_rows = table::read(mean, 3)?;
    if mean_rows.len() != count {
        let found = mean_rows.len().to_string();
        return Err(refuse(mean, "rows", format!("{count} keypoints"), found));
    }
    let basis_rows = table::read(basis, 3 * count)?;
    let vector = |row: &[f64]| Vector3::new(row[0], row[1], row[2]);
    let turn = axes(options.layout);
    let turned: Vec<Vector3<f64>> = mean_rows.iter().map(|row| turn * vector(row)).collect();

    let own = ShapePrior::of_family(options.layout);
    let frame = Frame::matching(&own, &turned, options)
        .ok_or_else(|| refuse(mean, "rows", "points that span a body".into(), "a flat one".into()))?;
    let metres: Vec<Point3<f64>> = turned.iter().map(|v| frame.to_metres(v)).collect();

    // Displacements in the table's unit and axes turned; rows are unit vectors there, so λ = V · (x − x̄).
    let directions: Vec<Vec<Vector3<f64>>> =
        basis_rows.iter().map(|row| row.chunks_exact(3).map(|v| turn * vector(v)).collect()).collect();
    let project = |points: &[Point3<f64>], direction: &[Vector3<f64>]| -> f64 {
        let length: f64 = direction.iter().map(Vector3::norm_squared).sum();
        let offsets = points.iter().zip(&turned).map(|(p, mean)| frame.to_table(p) - mean);
        offsets.zip(direction).map(|(offset, v)| offset.dot(v)).sum::<f64>() / length.max(1e-300)
    };
    let origin = basis.display().to_string();
    let sizing = options.length_m / own.dimensions(&[]).length_m;
    let basis: Vec<Deformation> = directions
        .iter()
        .map(|direction| Deformation {
            variance: own_variance(&own, &frame, direction).max(1e-12),
            displacements: direction.iter().map(|v| frame.scale.component_mul(v)).collect(),
        })
        .collect();
    let named = own
        .named_shapes()
        .iter()
        .map(|shape| {
            let body: Vec<Point3<f64>> =
                own.body(&shape.coefficients).keypoints.iter().map(|p| p * sizing).collect();
            let coefficients = directions.iter().map(|d| project(&body, d)).collect();
            NamedShape { body_type: shape.body_type, coefficients, blueprint: None }
        })
        .collect();
    let parts = PriorParts {
        name: format!("{} keypoints, converted", count),
        keypoints: own.keypoints().to_vec(),
        outline: Vec::new(),
        mean: metres,
        basis,
        named,
    };
    ShapePrior::new(parts, &origin)
}

/// Axes of the tables to those of the vehicle frame.
fn axes(layout: Layout) -> Matrix3<f64> {
    match layout {
        Layout::Car36 => Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0),
        Layout::Car14 => Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
    }
}

/// Scale and origin: `metres = scale ∘ (v − centre) + offset`.
struct Frame {
    scale: Vector3<f64>,
    centre: Vector3<f64>,
    offset: Vector3<f64>,
}

impl Frame {
    /// Puts the extent of the points where that of our own mean lies, at the wanted length; the wheels at the height of
    /// our own.
    fn matching(own: &ShapePrior, points: &[Vector3<f64>], options: &ConvertOptions) -> Option<Self> {
        let mean = own.dimensions(&[]);
        let sizing = options.length_m / mean.length_m;
        let own_points: Vec<Vector3<f64>> =
            own.mean()[..own.keypoints().len()].iter().map(|p| p.coords * sizing).collect();
        let (low, high) = range(points);
        let (own_low, own_high) = range(&own_points);
        let extent = high - low;
        if extent.iter().any(|side| *side < 1e-9) {
            return None;
        }
        let mut scale = (own_high - own_low).component_div(&extent);
        let own_proportions = match options.proportions {
            Proportions::Kept => false,
            Proportions::Own => true,
            Proportions::ByLayout => options.layout == Layout::Car14,
        };
        if !own_proportions {
            scale = Vector3::repeat(scale.x);
        }
        let wheels: [usize; 4] = match options.layout {
            Layout::Car36 => [0, 1, 18, 19],
            Layout::Car14 => [0, 1, 2, 3],
        };
        let wheel_height = |points: &[Vector3<f64>]| wheels.iter().map(|i| points[*i].z).sum::<f64>() / 4.0;
        let mut centre = 0.5 * (low + high);
        let mut offset = 0.5 * (own_low + own_high);
        centre.z = wheel_height(points);
        offset.z = wheel_height(&own_points);
        Some(Self { scale, centre, offset })
    }
    fn to_metres(&self, v: &Vector3<f64>) -> Point3<f64> {
        Point3::from(self.scale.component_mul(&(v - self.centre)) + self.offset)
    }
    fn to_table(&self, p: &Point3<f64>) -> Vector3<f64> {
        (p.coords - self.offset).component_div(&self.scale) + self.centre
    }
}

fn range(points: &[Vector3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
    let start = (Vector3::repeat(f64::MAX), Vector3::repeat(f64::MIN));
    points.iter().fold(start, |(low, high), p| (low.inf(p), high.sup(p)))
}

/// Variance of our family along a direction of the table: `Σ_b variance_b (V · W_b)²`, W_b our own deformations in the
/// table's unit.
fn own_variance(own: &ShapePrior, frame: &Frame, direction: &[Vector3<f64>]) -> f64 {
    let length: f64 = direction.iter().map(Vector3::norm_squared).sum();
    own.basis()
        .iter()
        .map(|deformation| {
            let along: f64 = direction
                .iter()
                .zip(&deformation.displacements)
                .map(|(v, w)| v.dot(&w.component_div(&frame.scale)))
                .sum();
            deformation.variance * (along / length.max(1e-300)).powi(2)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    /// Writes our own prior as tables in the published axes and an odd unit, and converts it back.
    #[test]
    fn our_own_prior_comes_back_through_tables() {
        for layout in [Layout::Car36, Layout::Car14] {
            let own = ShapePrior::of_family(layout);
            let turn = axes(layout).transpose();
            let row = |out: &mut String, v: Vector3<f64>| write!(out, "{} {} {} ", v.x, v.y, v.z).unwrap();
            let (mut mean, mut basis) = (String::from("# mean\n"), String::new());
            for p in &own.mean()[..layout.count()] {
                row(&mut mean, turn * (p.coords - Vector3::z()) * 0.2);
                mean.push('\n');
            }
            for d in own.basis() {
                d.displacements[..layout.count()].iter().for_each(|v| row(&mut basis, turn * v));
                basis.push('\n');
            }
            let folder = tempfile::tempdir().unwrap();
            let (a, b) = (folder.path().join("mean.txt"), folder.path().join("basis.txt"));
            std::fs::write(&a, &mean).unwrap();
            std::fs::write(&b, &basis).unwrap();
            let length_m = own.dimensions(&[]).length_m;
            let options = ConvertOptions { length_m, ..ConvertOptions::new(layout) };
            let back = convert(&a, &b, &options).unwrap();
            for (p, q) in back.mean().iter().zip(own.mean()) {
                assert!((p - q).norm() < 1e-9, "{layout:?}: {p} {q}");
            }
            assert_eq!(back.basis().len(), own.basis().len());
            // The widest deformation moves the points as ours does: 1 σ by the same distance.
            let moved = |p: &ShapePrior| {
                let d = &p.basis()[0];
                let n = layout.count();
                d.variance.sqrt() * d.displacements[..n].iter().map(|v| v.norm_squared()).sum::<f64>().sqrt()
            };
            assert!((moved(&back) / moved(&own) - 1.0).abs() < 0.2, "{} {}", moved(&back), moved(&own));
        }
    }

    #[test]
    fn tables_that_do_not_read_are_named_with_line_and_expectation() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("mean.txt"), folder.path().join("basis.txt"));
        std::fs::write(&b, "").unwrap();
        let message = |text: &str| {
            std::fs::write(&a, text).unwrap();
            convert(&a, &b, &ConvertOptions::new(Layout::Car14)).unwrap_err().to_string()
        };
        assert!(message("1 2 3\n1 x 3\n").ends_with("mean.txt:2: expected a finite number, found `x`"));
        assert!(message("1 2\n").contains("mean.txt:1: expected 3 numbers, found 2"));
        assert!(message("1 2 3\n").contains("expected 14 keypoints, found 1"));
    }
}
