//! A level path of dense points.

use nalgebra::{Point2, Vector2};

/// Points about half a metre apart, extended straight beyond the ends.
#[derive(Clone, Debug)]
pub(crate) struct Path {
    points: Vec<Point2<f64>>,
    along_m: Vec<f64>,
}

impl Path {
    /// Through points, at least two of which differ.
    pub(crate) fn through(points: impl IntoIterator<Item = Point2<f64>>) -> Option<Self> {
        let mut path = Self { points: Vec::new(), along_m: Vec::new() };
        for point in points {
            let (along, far) = match (path.points.last(), path.along_m.last()) {
                (Some(last), Some(along)) => (along + (point - last).norm(), (point - last).norm() > 1e-3),
                _ => (0.0, true),
            };
            if far {
                path.points.push(point);
                path.along_m.push(along);
            }
        }
        (path.points.len() >= 2).then_some(path)
    }

    /// Point and unit direction at a distance along the path.
    pub(crate) fn at(&self, along_m: f64) -> (Point2<f64>, Vector2<f64>) {
        let i = self.along_m.partition_point(|a| *a <= along_m).clamp(1, self.points.len() - 1) - 1;
        let (a, b) = (self.points[i], self.points[i + 1]);
        let direction = (b - a).normalize();
        (a + direction * (along_m - self.along_m[i]), direction)
    }

    /// Distance along the path of the point nearest to a position that was at `since_m` shortly before \[m\].
    pub(crate) fn progress(&self, point: &Point2<f64>, since_m: f64) -> f64 {
        let mut along = since_m;
        for _ in 0..3 {
            let (on_path, direction) = self.at(along);
            along += (point - on_path).dot(&direction).clamp(-2.0, 2.0);
        }
        along
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_goes_on_beyond_its_end() {
        let path = Path::through([Point2::new(0.0, 0.0), Point2::new(0.0, 2.0)]).unwrap();
        assert_eq!(path.at(5.0).0, Point2::new(0.0, 5.0));
        assert!((path.progress(&Point2::new(1.0, 1.5), 0.9) - 1.5).abs() < 1e-12);
        assert!(Path::through([Point2::origin(), Point2::origin()]).is_none());
    }
}
