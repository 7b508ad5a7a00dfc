//! Upright cuboids and their overlap.

use motorcade_dataset::Label;

/// Vertices of a footprint or of the intersection of two.
type Polygon = Vec<[f64; 2]>;

/// Footprints whose centres are farther apart do not overlap: half the diagonal of two long lorries \[m\].
const FARTHEST_M: f64 = 40.0;

/// A labelled or estimated vehicle as an upright cuboid in camera coordinates.
pub(crate) struct Cuboid {
    /// Corners (x, z), counterclockwise seen from below (y down) \[m\].
    footprint: Polygon,
    centre: [f64; 2],
    /// Top and bottom along y \[m\].
    height_range: [f64; 2],
    volume_m3: f64,
}

impl Cuboid {
    /// KITTI's convention: bottom-face centre, height, width and length, rotation about y from the x axis.
    pub(crate) fn of(label: &Label) -> Self {
        let ([height, width, length], [x, y, z]) = (label.size_hwl_m, label.location_m);
        let (sin, cos) = label.ry_rad.sin_cos();
        let corner = |[along, across]: [f64; 2]| {
            let (a, b) = (along * length, across * width);
            [x + cos * a + sin * b, z - sin * a + cos * b]
        };
        let mut footprint: Polygon =
            [[0.5, 0.5], [0.5, -0.5], [-0.5, -0.5], [-0.5, 0.5]].map(corner).to_vec();
        if signed_area(&footprint) < 0.0 {
            footprint.reverse();
        }
        Self { footprint, centre: [x, z], height_range: [y - height, y], volume_m3: height * width * length }
    }

    /// Intersection over union of the volumes and of the footprints.
    pub(crate) fn iou(&self, other: &Self) -> Overlap {
        let [dx, dz] = [self.centre[0] - other.centre[0], self.centre[1] - other.centre[1]];
        if dx.hypot(dz) > FARTHEST_M {
            return Overlap::default();
        }
        let both = intersection(&self.footprint, &other.footprint);
        let area = signed_area(&both).max(0.0);
        let [low, high] = [
            self.height_range[0].max(other.height_range[0]),
            self.height_range[1].min(other.height_range[1]),
        ];
        let volume = area * (high - low).max(0.0);
        let share = |both: f64, a: f64, b: f64| if both > 0.0 { both / (a + b - both) } else { 0.0 };
        Overlap {
            volume: share(volume, self.volume_m3, other.volume_m3),
            footprint: share(area, signed_area(&self.footprint), signed_area(&other.footprint)),
        }
    }
}

/// Overlap of two cuboids.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Overlap {
    /// IoU of the volumes.
    pub(crate) volume: f64,
    /// IoU of the footprints, seen from above.
    pub(crate) footprint: f64,
}

/// Area, positive for counterclockwise vertices.
fn signed_area(polygon: &[[f64; 2]]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    0.5 * polygon.iter().zip(next).map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum::<f64>()
}

/// Intersection of two convex counterclockwise polygons (Sutherland and Hodgman, CACM 1974).
fn intersection(subject: &[[f64; 2]], clip: &[[f64; 2]]) -> Polygon {
    let mut out = subject.to_vec();
    for (a, b) in clip.iter().zip(clip.iter().cycle().skip(1)) {
        let side = |p: &[f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        let mut kept = Polygon::with_capacity(out.len() + 1);
        for (p, q) in out.iter().zip(out.iter().cycle().skip(1)) {
            let (of_p, of_q) = (side(p), side(q));
            if of_p >= 0.0 {
                kept.push(*p);
            }
            if (of_p >= 0.0) != (of_q >= 0.0) {
                let t = of_p / (of_p - of_q);
                kept.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
            }
        }
        out = kept;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::BoundingBox;
    use std::f64::consts::FRAC_PI_4;

    fn car(location_m: [f64; 3], ry_rad: f64) -> Label {
        Label {
            frame: 0,
            track: 0,
            class: "Car".into(),
            truncated: 0.0,
            occluded: 0.0,
            alpha_rad: 0.0,
            bbox: BoundingBox::new([0.0; 4]),
            size_hwl_m: [1.5, 2.0, 4.0],
            location_m,
            ry_rad,
            score: None,
        }
    }

    #[test]
    fn overlaps_of_shifted_lifted_and_turned_boxes() {
        let iou = |a: &Label, b: &Label| Cuboid::of(a).iou(&Cuboid::of(b));
        let one = car([1.0, 1.65, 20.0], 0.3);
        let same = iou(&one, &one);
        assert!((same.volume - 1.0).abs() < 1e-12 && (same.footprint - 1.0).abs() < 1e-12);
        // Half a length ahead: a third.
        let ahead = car([1.0 + 2.0 * 0.3_f64.cos(), 1.65, 20.0 - 2.0 * 0.3_f64.sin()], 0.3);
        assert!((iou(&one, &ahead).footprint - 1.0 / 3.0).abs() < 1e-12);
        // Half its height above: a third of the volume.
        let lifted = iou(&one, &car([1.0, 0.9, 20.0], 0.3));
        assert!((lifted.volume - 1.0 / 3.0).abs() < 1e-12 && (lifted.footprint - 1.0).abs() < 1e-12);
        assert_eq!(iou(&one, &car([1.0, 1.65, 30.0], 0.3)), Overlap::default());
        // Two squares of side 2, one turned by 45°: a regular octagon of area 8 (√2 − 1).
        let square = |ry| Label { size_hwl_m: [1.0, 2.0, 2.0], ..car([0.0, 1.65, 9.0], ry) };
        let octagon = 8.0 * (2.0_f64.sqrt() - 1.0);
        let found = iou(&square(0.0), &square(FRAC_PI_4)).footprint;
        assert!((found - octagon / (8.0 - octagon)).abs() < 1e-12, "{found}");
    }
}
