//! The built-in priors: principal components of the family of cars.

use nalgebra::{DMatrix, DVector, Point3, SymmetricEigen, Vector3};

use crate::blueprint::{Blueprint, SidePoint};
use crate::body_type::BodyType;
use crate::family::{CarModel, FAMILY};
use crate::keypoint::{Keypoint, Layout, mirrored};
use crate::prior::{Deformation, NamedShape, PriorParts, ShapePrior};

/// Deformations kept: they hold 99 % of the family's variance (tested).
pub(crate) const COMPONENTS: usize = 8;

impl ShapePrior {
    /// The project's own car in one of the built-in layouts: mean and principal components of [`FAMILY`], each body type
    /// weighted by its [share](BodyType::share) of traffic. Both layouts share their coefficients: the components are
    /// those of both layouts' keypoints and the outline together.
    pub fn of_family(layout: Layout) -> Self {
        let family = Family::of(FAMILY);
        family.prior(layout)
    }
}

/// Mean and components over the left sides of the drawings.
struct Family {
    mean: DVector<f64>,
    components: Vec<(f64, DVector<f64>)>,
    names: [Vec<SidePoint>; 3],
    named: Vec<NamedShape>,
}

fn side(blueprint: &Blueprint) -> [Vec<SidePoint>; 3] {
    [blueprint.side_36(), blueprint.side_14(), blueprint.side_outline()]
}

/// The left side's points as one column.
fn column(blueprint: &Blueprint) -> DVector<f64> {
    let points = side(blueprint).into_iter().flatten();
    DVector::from_iterator(
        3 * side(blueprint).iter().map(Vec::len).sum::<usize>(),
        points.flat_map(|p| [p.position.x, p.position.y, p.position.z]),
    )
}

impl Family {
    fn of(models: &[CarModel]) -> Self {
        let count = |t: BodyType| models.iter().filter(|m| m.body_type == t).count() as f64;
        let weights: Vec<f64> = models.iter().map(|m| m.body_type.share() / count(m.body_type)).collect();
        let columns: Vec<DVector<f64>> = models.iter().map(|m| column(&m.blueprint)).collect();
        let rows = columns.first().map_or(0, DVector::len);
        let mean = columns.iter().zip(&weights).fold(DVector::zeros(rows), |sum, (c, w)| sum + c * *w);

        // Columns √w (x − x̄); the eigenvectors of the small Gram matrix give those of the covariance.
        let centred = DMatrix::from_columns(
            &columns.iter().zip(&weights).map(|(c, w)| (c - &mean) * w.sqrt()).collect::<Vec<_>>(),
        );
        let eigen = SymmetricEigen::new(centred.transpose() * &centred);
        let mut order: Vec<usize> = (0..models.len()).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let components: Vec<(f64, DVector<f64>)> = order
            .into_iter()
            .take(COMPONENTS)
            .map(|k| {
                let mut direction: DVector<f64> = (&centred * eigen.eigenvectors.column(k)).normalize();
                // The sign of an eigenvector is arbitrary: it is set by its x components.
                let largest = direction.iamax();
                if direction[largest] < 0.0 {
                    direction = -direction;
                }
                (eigen.eigenvalues[k], direction)
            })
            .collect();

        let named = BodyType::ALL
            .into_iter()
            .filter_map(|body_type| {
                let of_type: Vec<&Blueprint> =
                    models.iter().filter(|m| m.body_type == body_type).map(|m| &m.blueprint).collect();
                let blueprint = Blueprint::average(&of_type)?;
                let offset = column(&blueprint) - &mean;
                let coefficients = components.iter().map(|(_, v)| v.dot(&offset)).collect();
                Some(NamedShape { body_type, coefficients, blueprint: Some(blueprint) })
            })
            .collect();
        let names = models.first().map_or_else(Default::default, |m| side(&m.blueprint));
        Self { mean, components, names, named }
    }

    fn prior(self, layout: Layout) -> ShapePrior {
        let [side_36, side_14, side_outline] = &self.names;
        let (first, points) = match layout {
            Layout::Car36 => (0, side_36),
            Layout::Car14 => (side_36.len(), side_14),
        };
        let outline_first = side_36.len() + side_14.len();
        let total = layout.count() + 2 * side_outline.len();

        // Indices of every left-side point of the column and of its mirror image.
        let mut places: Vec<(usize, usize, usize)> = Vec::new();
        for i in 0..points.len() {
            let (left, right) = layout.pair(i);
            places.push((first + i, left, right));
        }
        for i in 0..side_outline.len() {
            let left = layout.count() + 2 * i;
            places.push((outline_first + i, left, left + 1));
        }
        let spread = |column: &DVector<f64>| {
            let mut out = vec![Vector3::zeros(); total];
            for (from, left, right) in &places {
                let v = Vector3::new(column[3 * from], column[3 * from + 1], column[3 * from + 2]);
                out[*left] = v;
                out[*right] = mirrored(&v);
            }
            out
        };

        let mut keypoints =
            vec![Keypoint { name: String::new(), mirror: 0, faces: Vec::new() }; layout.count()];
        for (i, point) in points.iter().enumerate() {
            let (left, right) = layout.pair(i);
            let faces: Vec<Vector3<f64>> = point.faces.iter().map(|f| Vector3::from(*f)).collect();
            let mirrored_faces = faces.iter().map(mirrored).collect();
            keypoints[left] = Keypoint { name: format!("{}, left", point.name), mirror: right, faces };
            keypoints[right] =
                Keypoint { name: format!("{}, right", point.name), mirror: left, faces: mirrored_faces };
        }
        let outline = side_outline
            .iter()
            .flat_map(|p| [format!("{}, left", p.name), format!("{}, right", p.name)])
            .collect();
        let name = match layout {
            Layout::Car36 => "motorcade car, 36 keypoints",
            Layout::Car14 => "motorcade car, 14 keypoints",
        };
        let basis = self.components.iter();
        ShapePrior::assemble(PriorParts {
            name: name.to_owned(),
            keypoints,
            outline,
            mean: spread(&self.mean).into_iter().map(Point3::from).collect(),
            basis: basis
                .map(|(variance, v)| Deformation { variance: *variance, displacements: spread(v) })
                .collect(),
            named: self.named,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYOUTS: [Layout; 2] = [Layout::Car36, Layout::Car14];

    #[test]
    fn own_priors_pass_their_own_check_and_come_out_the_same_each_time() {
        for layout in LAYOUTS {
            let prior = ShapePrior::of_family(layout);
            assert_eq!(prior.keypoints().len(), layout.count());
            let again = ShapePrior::new(prior.to_parts(), "test").unwrap();
            assert_eq!(again, prior);
            assert_eq!(ShapePrior::of_family(layout), prior);
        }
    }

    #[test]
    fn every_shape_is_symmetric_and_stands_on_the_road() {
        for layout in LAYOUTS {
            let prior = ShapePrior::of_family(layout);
            let shape: Vec<f64> = prior.basis().iter().map(|d| d.variance.sqrt()).collect();
            let points = prior.points(&shape);
            for (i, keypoint) in prior.keypoints().iter().enumerate() {
                let other = mirrored(&points[keypoint.mirror].coords);
                assert!((points[i].coords - other).norm() == 0.0, "{}", keypoint.name);
                assert_ne!(keypoint.mirror, i);
            }
            let body = prior.body(&shape);
            for (name, point) in prior.outline().iter().zip(&body.outline) {
                assert!(!name.contains("on the road") || point.z.abs() < 1e-12, "{name}: {point}");
                assert!(point.x.abs() <= 0.5 * body.dimensions.length_m + 1e-9, "{name}");
            }
        }
    }

    #[test]
    fn components_span_the_family() {
        let prior = ShapePrior::of_family(Layout::Car36);
        let (mut squares, mut total) = (0.0, 0.0);
        for model in FAMILY {
            let side = model.blueprint.side_36();
            let target: Vec<_> = side.iter().map(|p| p.position).collect();
            // Coefficients by projection over keypoints alone would mix; the named shapes' way is the column's.
            let family = Family::of(FAMILY);
            let offset = column(&model.blueprint) - &family.mean;
            let shape: Vec<f64> = family.components.iter().map(|(_, v)| v.dot(&offset)).collect();
            let points = prior.points(&shape);
            for (i, p) in target.iter().enumerate() {
                squares += (points[i] - p).norm_squared();
                total += (prior.mean()[i] - p).norm_squared();
            }
            let found = prior.dimensions(&shape).to_vector();
            let error = (found - model.blueprint.dimensions().to_vector()).amax();
            assert!(error < 0.06, "{}: {error}", model.name);
        }
        assert!(squares / total < 0.01, "left over {}", squares / total);
    }

    #[test]
    fn body_types_differ_as_they_should() {
        let prior = ShapePrior::of_family(Layout::Car14);
        let size = |t: BodyType| prior.dimensions(prior.coefficients_of(t).unwrap());
        assert_eq!(prior.named_shapes().len(), BodyType::ALL.len());
        assert!(size(BodyType::City).length_m < 3.75 && size(BodyType::Saloon).length_m > 4.5);
        let ordinary = size(BodyType::Hatchback).height_m;
        assert!(size(BodyType::Van).height_m > ordinary + 0.15);
        assert!(size(BodyType::Coupe).height_m < ordinary - 0.06);
        for named in prior.named_shapes() {
            let drawn = named.blueprint.unwrap().dimensions().to_vector();
            assert!((size(named.body_type).to_vector() - drawn).amax() < 0.05, "{:?}", named.body_type);
        }
    }

    #[test]
    fn a_size_finds_its_shape() {
        let prior = ShapePrior::of_family(Layout::Car36);
        let mean = crate::Dimensions { length_m: 3.7, width_m: 1.66, height_m: 1.5 };
        let sigma = crate::Dimensions { length_m: 0.05, width_m: 0.03, height_m: 0.03 };
        let shape = prior.coefficients_for(&crate::SizePrior { mean, sigma });
        assert!((prior.dimensions(&shape).to_vector() - mean.to_vector()).amax() < 0.06);
    }
}
