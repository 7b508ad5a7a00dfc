//! The shape prior: mean positions of named points and their principal deformations (equations 6–8 of the paper).

use motorcade_geometry::alignment::umeyama;
use nalgebra::{Point3, Vector3};

use crate::blueprint::Blueprint;
use crate::body_type::BodyType;
use crate::dimensions::{Dimensions, SizePrior};
use crate::error::PriorError;
use crate::keypoint::Keypoint;

/// One deformation V_b of the basis with the variance of its coefficient.
#[derive(Clone, Debug, PartialEq)]
pub struct Deformation {
    /// Variance of λ_b over vehicles (λ_b is in units of the displacements).
    pub variance: f64,
    /// Displacement of every point of the prior for λ_b = 1 (points × 3) \[m\].
    pub displacements: Vec<Vector3<f64>>,
}

/// A body type as coefficients of a prior.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedShape {
    /// The body type.
    pub body_type: BodyType,
    /// Coefficients λ, one per deformation.
    pub coefficients: Vec<f64>,
    /// The mean drawing of the type's models, for meshes; imported priors have none.
    pub blueprint: Option<Blueprint>,
}

/// Mean positions of named points and their variation: `X = X̄ + Σ_b λ_b V_b`, `λ_b ~ N(0, variance_b)`.
///
/// Vehicle frame \[m\]: x forward, y left, z up, origin on the road below the body's centre. Points are the keypoints,
/// then the outline, which bounds the body but is not detected by networks.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapePrior {
    name: String,
    keypoints: Vec<Keypoint>,
    outline: Vec<String>,
    mean: Vec<Point3<f64>>,
    basis: Vec<Deformation>,
    named: Vec<NamedShape>,
    extent: Extent,
}

/// The points of the mean that bound it: their distances are its dimensions.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Extent {
    nose: usize,
    tail: usize,
    left: usize,
    right: usize,
    top: usize,
}

/// Unchecked content of a [`ShapePrior`].
#[derive(Clone, Debug, PartialEq)]
pub struct PriorParts {
    /// Name.
    pub name: String,
    /// The keypoints.
    pub keypoints: Vec<Keypoint>,
    /// Names of the outline points; may be empty.
    pub outline: Vec<String>,
    /// Mean places of keypoints, then outline (points × 3, vehicle frame) \[m\].
    pub mean: Vec<Point3<f64>>,
    /// Deformations, in any order.
    pub basis: Vec<Deformation>,
    /// Body types; may be empty.
    pub named: Vec<NamedShape>,
}

/// Points of a vehicle of a certain shape, for meshes.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Keypoints (vehicle frame) \[m\].
    pub keypoints: Vec<Point3<f64>>,
    /// Outline points (vehicle frame) \[m\].
    pub outline: Vec<Point3<f64>>,
    /// Outer size.
    pub dimensions: Dimensions,
}

impl ShapePrior {
    /// Checks the parts; `origin` (a file name) stands in the errors. Deformations are put in order of falling variance.
    pub fn new(parts: PriorParts, origin: &str) -> Result<Self, PriorError> {
        check(&parts, origin)?;
        Ok(Self::assemble(parts))
    }

    /// Parts that are valid by construction.
    pub(crate) fn assemble(mut parts: PriorParts) -> Self {
        let mut order: Vec<usize> = (0..parts.basis.len()).collect();
        order.sort_by(|a, b| parts.basis[*b].variance.total_cmp(&parts.basis[*a].variance));
        for shape in &mut parts.named {
            shape.coefficients = order.iter().map(|k| shape.coefficients[*k]).collect();
        }
        let basis = order.iter().map(|k| parts.basis[*k].clone()).collect();
        let extent = Extent::of(&parts.mean, &parts.outline, parts.keypoints.len());
        let PriorParts { name, keypoints, outline, mean, named, .. } = parts;
        Self { name, keypoints, outline, mean, basis, named, extent }
    }

    /// The parts, for files and derived priors.
    pub fn to_parts(&self) -> PriorParts {
        PriorParts {
            name: self.name.clone(),
            keypoints: self.keypoints.clone(),
            outline: self.outline.clone(),
            mean: self.mean.clone(),
            basis: self.basis.clone(),
            named: self.named.clone(),
        }
    }

    /// Name.
    pub fn name(&self) -> &str {
        &self.name
    }
    /// The keypoints, in the order of network outputs.
    pub fn keypoints(&self) -> &[Keypoint] {
        &self.keypoints
    }
    /// Names of the outline points; empty for priors that have none.
    pub fn outline(&self) -> &[String] {
        &self.outline
    }
    /// Mean of keypoints, then outline (vehicle frame) \[m\].
    pub fn mean(&self) -> &[Point3<f64>] {
        &self.mean
    }
    /// The deformations by falling variance.
    pub fn basis(&self) -> &[Deformation] {
        &self.basis
    }
    /// Body types with their coefficients and drawings.
    pub fn named_shapes(&self) -> &[NamedShape] {
        &self.named
    }
    /// Coefficients of a body type, when the prior has it.
    pub fn coefficients_of(&self, body_type: BodyType) -> Option<&[f64]> {
        self.named.iter().find(|n| n.body_type == body_type).map(|n| n.coefficients.as_slice())
    }

    /// All points of a shape, keypoints then outline: `X̄ + Σ_b λ_b V_b`. Missing coefficients are 0, surplus ones are ignored.
    pub fn points(&self, coefficients: &[f64]) -> Vec<Point3<f64>> {
        let mut points = self.mean.clone();
        for (deformation, lambda) in self.basis.iter().zip(coefficients) {
            for (point, displacement) in points.iter_mut().zip(&deformation.displacements) {
                *point += displacement * *lambda;
            }
        }
        points
    }

    /// Keypoints, outline and size of a shape.
    pub fn body(&self, coefficients: &[f64]) -> Body {
        let mut keypoints = self.points(coefficients);
        let dimensions = self.dimensions_of(&keypoints);
        let outline = keypoints.split_off(self.keypoints.len());
        Body { keypoints, outline, dimensions }
    }

    /// Outer size of a shape. Without an outline it is the extent of the keypoints, a few centimetres less than the body's.
    pub fn dimensions(&self, coefficients: &[f64]) -> Dimensions {
        self.dimensions_of(&self.points(coefficients))
    }

    fn dimensions_of(&self, points: &[Point3<f64>]) -> Dimensions {
        let Extent { nose, tail, left, right, top } = self.extent;
        Dimensions {
            length_m: points[nose].x - points[tail].x,
            width_m: points[left].y - points[right].y,
            height_m: points[top].z,
        }
    }

    /// Change of (length, width, height) with coefficient `b` \[m\]: dimensions are linear in the shape.
    pub(crate) fn dimension_slope(&self, b: usize) -> Vector3<f64> {
        let Extent { nose, tail, left, right, top } = self.extent;
        let d = &self.basis[b].displacements;
        Vector3::new(d[nose].x - d[tail].x, d[left].y - d[right].y, d[top].z)
    }

    /// The most likely coefficients for a size: minimises `Σ λ_b²/variance_b + |size(λ) − mean|²/sigma²`.
    pub fn coefficients_for(&self, size: &SizePrior) -> Vec<f64> {
        // With W = variances and D the slopes (3 × B): λ = W Dᵀ (D W Dᵀ + S)⁻¹ (mean − size(0)).
        let slopes: Vec<Vector3<f64>> = (0..self.basis.len()).map(|b| self.dimension_slope(b)).collect();
        let sigma = size.sigma.to_vector();
        let mut gram = nalgebra::Matrix3::from_diagonal(&sigma.component_mul(&sigma));
        for (slope, deformation) in slopes.iter().zip(&self.basis) {
            gram += slope * slope.transpose() * deformation.variance;
        }
        let wanted = size.mean.to_vector() - self.dimensions(&[]).to_vector();
        let pull = gram.cholesky().map_or_else(Vector3::zeros, |c| c.solve(&wanted));
        slopes.iter().zip(&self.basis).map(|(slope, d)| d.variance * slope.dot(&pull)).collect()
    }

    /// Root mean square distance of the mean keypoints from other ones, `other` aligned to them by a
    /// similarity \[m\]. `None` when the counts differ.
    pub fn rms_to(&self, other: &[Point3<f64>]) -> Option<f64> {
        let ours: Vec<_> = self.mean[..self.keypoints.len()].iter().map(|p| p.coords).collect();
        let theirs: Vec<_> = other.iter().map(|p| p.coords).collect();
        let ours_from_theirs = umeyama(&theirs, &ours, true)?;
        let squares: f64 = other
            .iter()
            .zip(&ours)
            .map(|(p, q)| (ours_from_theirs.transform_point(p).coords - q).norm_squared())
            .sum();
        Some((squares / ours.len() as f64).sqrt())
    }
}

impl Extent {
    /// Extremes of the mean; mirrors do not count for the width.
    fn of(mean: &[Point3<f64>], outline: &[String], keypoints: usize) -> Self {
        let is_mirror = |i: usize| i >= keypoints && outline[i - keypoints].contains("mirror");
        let most = |value: &dyn Fn(&Point3<f64>) -> f64, from: usize| {
            (from..mean.len())
                .filter(|i| !is_mirror(*i))
                .max_by(|a, b| value(&mean[*a]).total_cmp(&value(&mean[*b])))
                .unwrap_or(0)
        };
        // The outline bounds the body where there is one.
        let from = if outline.is_empty() { 0 } else { keypoints };
        Self {
            nose: most(&|p| p.x, from),
            tail: most(&|p| -p.x, from),
            left: most(&|p| p.y, from),
            right: most(&|p| -p.y, from),
            top: most(&|p| p.z, from),
        }
    }
}

fn check(parts: &PriorParts, origin: &str) -> Result<(), PriorError> {
    let refuse = |field: String, expected: String, found: String| {
        Err(PriorError::Field { origin: origin.to_owned(), field, expected, found })
    };
    let n = parts.keypoints.len();
    let all = n + parts.outline.len();
    if n < 4 {
        return refuse("keypoints".into(), "at least 4 of them".into(), n.to_string());
    }
    if parts.mean.len() != all {
        return refuse("mean".into(), format!("{all} points"), parts.mean.len().to_string());
    }
    for (i, keypoint) in parts.keypoints.iter().enumerate() {
        let back = parts.keypoints.get(keypoint.mirror).map(|k| k.mirror);
        if back != Some(i) {
            let expected = format!("a keypoint (0 to {}) whose mirror is {i}", n - 1);
            return refuse(format!("keypoints[{i}].mirror"), expected, keypoint.mirror.to_string());
        }
        for (k, face) in keypoint.faces.iter().enumerate() {
            let unit = (face.norm() - 1.0).abs() < 1e-6;
            if !unit {
                let found = format!("length {}", face.norm());
                return refuse(format!("keypoints[{i}].faces[{k}]"), "a unit vector".into(), found);
            }
        }
    }
    // Hundreds of metres are a wrong unit.
    let plausible = |v: &Vector3<f64>| v.iter().all(|c| c.is_finite() && c.abs() < 50.0);
    for (i, point) in parts.mean.iter().enumerate() {
        if !plausible(&point.coords) {
            let found = format!("({}, {}, {})", point.x, point.y, point.z);
            return refuse(format!("mean of point {i}"), "metres, below 50 in size".into(), found);
        }
    }
    for (b, deformation) in parts.basis.iter().enumerate() {
        if !(deformation.variance.is_finite() && deformation.variance > 0.0) {
            let found = deformation.variance.to_string();
            return refuse(format!("basis[{b}].variance"), "a positive number".into(), found);
        }
        if deformation.displacements.len() != all {
            let found = deformation.displacements.len().to_string();
            return refuse(format!("basis[{b}].displacements"), format!("{all} vectors"), found);
        }
        if !deformation.displacements.iter().all(plausible) {
            let expected = "finite numbers below 50 in size".into();
            return refuse(format!("basis[{b}].displacements"), expected, "something else".into());
        }
    }
    for (i, shape) in parts.named.iter().enumerate() {
        let right = shape.coefficients.len() == parts.basis.len();
        if !right || !shape.coefficients.iter().all(|c| c.is_finite()) {
            let expected = format!("{} finite numbers", parts.basis.len());
            let found = format!("{:?}", shape.coefficients);
            return refuse(format!("body_types[{i}].coefficients"), expected, found);
        }
    }
    Ok(())
}
