//! A detected box and which of its edges are measurements.

use motorcade_geometry::PinholeCamera;
use motorcade_perception::{BoundingBox, BoxConvention, Detection, VehicleClass};

use crate::options::BoxFitOptions;

/// Slack of the occlusion test \[px\]: boxes that share an edge do not occlude each other.
pub(crate) const SLACK_PX: f64 = 1.0;

/// A box and which of its edges are measurements.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ObservedBox {
    /// The box \[px\].
    pub bbox: BoundingBox,
    /// Class of the vehicle.
    pub class: VehicleClass,
    /// Convention of the box.
    pub convention: BoxConvention,
    /// False for truncated and occluded edges (left, top, right, bottom).
    pub edges: [bool; 4],
    /// Size of a pixel of the detector's input \[px\].
    pub pixel_size: f64,
    /// Mean probability of road below the box, where it shows.
    pub road_below: Option<f64>,
}

impl ObservedBox {
    /// Classifies the edges: truncated where the box meets the image border, occluded where a nearer box (with a lower bottom
    /// edge) covers most of the edge. Boxes of projected cuboids are never occluded.
    pub fn new(
        detection: &Detection,
        camera: &PinholeCamera,
        others: &[BoundingBox],
        options: &BoxFitOptions,
    ) -> Self {
        let Detection { bbox, class, convention, pixel_size, road_below, .. } = *detection;
        let mut edges = inside_border(&bbox, camera, options.border_px * pixel_size);
        let nearer = |o: &&BoundingBox| {
            convention == BoxConvention::VisibleExtent && **o != bbox && o.y2 > bbox.y2 + SLACK_PX
        };
        for other in others.iter().filter(nearer) {
            let hidden = hidden_edges(&bbox, other, options.occluded_share);
            edges = std::array::from_fn(|edge| edges[edge] && !hidden[edge]);
        }
        Self { bbox, class, convention, edges, pixel_size, road_below }
    }

    /// True for a car truncated by the left or right border: its visible height may be that of a bonnet or boot. Lorries,
    /// buses and vans have one height along their length.
    pub(crate) fn is_truncated_part(&self, camera: &PinholeCamera, border_px: f64) -> bool {
        let [left, _, right, _] = inside_border(&self.bbox, camera, border_px * self.pixel_size);
        let truncated = !left || !right;
        truncated && self.class == VehicleClass::Car && self.convention == BoxConvention::VisibleExtent
    }

    /// True when the bottom edge is above the image border, so that another vehicle and not the border ends the box.
    pub(crate) fn ends_above_border(&self, camera: &PinholeCamera, border_px: f64) -> bool {
        inside_border(&self.bbox, camera, border_px * self.pixel_size)[3]
    }

    /// False when too few edges are measured to position a vehicle.
    pub(crate) fn is_sufficient(&self) -> bool {
        let [_, top, _, bottom] = self.edges;
        self.edges.iter().filter(|e| **e).count() >= 2 && (top || bottom)
    }
}

/// For each edge of a box (left, top, right, bottom) whether a nearer one covers more than a share of it.
pub(crate) fn hidden_edges(bbox: &BoundingBox, nearer: &BoundingBox, share: f64) -> [bool; 4] {
    let (w, h) = (bbox.width().max(1.0), bbox.height().max(1.0));
    let across = (bbox.x2.min(nearer.x2) - bbox.x1.max(nearer.x1)) / w;
    let down = (bbox.y2.min(nearer.y2) - bbox.y1.max(nearer.y1)) / h;
    let within = |v: f64, low: f64, high: f64| v > low && v < high;
    [
        down > share && within(bbox.x1, nearer.x1 - SLACK_PX, nearer.x2),
        false,
        down > share && within(bbox.x2, nearer.x1, nearer.x2 + SLACK_PX),
        across > share && within(bbox.y2, nearer.y1, nearer.y2),
    ]
}

/// For each edge (left, top, right, bottom) whether it is further than `border_px` from the image border.
pub(crate) fn inside_border(bbox: &BoundingBox, camera: &PinholeCamera, border_px: f64) -> [bool; 4] {
    let (right, bottom) = (f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
    [bbox.x1 > border_px, bbox.y1 > border_px, bbox.x2 < right - border_px, bbox.y2 < bottom - border_px]
}

/// IoU of a projected box and an observed one, whose truncated and occluded edges are bounds: they lie no further out than the projected ones.
pub(crate) fn overlap(projected: &BoundingBox, observed: &ObservedBox) -> f64 {
    let (p, mut o) = (projected.to_array(), observed.bbox.to_array());
    for (edge, measured) in observed.edges.iter().enumerate() {
        if !measured {
            o[edge] = if edge < 2 { o[edge].min(p[edge]) } else { o[edge].max(p[edge]) };
        }
    }
    BoundingBox::new(o).iou(projected)
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_testing::CAMERA;

    fn car(bbox: BoundingBox) -> Detection {
        let (class, convention) = (VehicleClass::Car, BoxConvention::VisibleExtent);
        Detection {
            class,
            score: 1.0,
            bbox,
            convention,
            external_id: None,
            pixel_size: 1.0,
            road_below: None,
        }
    }

    #[test]
    fn truncated_and_occluded_edges_are_recognised() {
        let options = BoxFitOptions::default();
        let observed = |d: &Detection, others: &[BoundingBox]| ObservedBox::new(d, &CAMERA, others, &options);
        let truncated = BoundingBox { x1: 0.0, y1: 150.0, x2: 200.0, y2: 374.0 };
        let found = observed(&car(truncated), &[]);
        assert_eq!(found.edges, [false, true, true, false]);
        assert!(found.is_truncated_part(&CAMERA, options.border_px));
        let far = BoundingBox { x1: 500.0, y1: 170.0, x2: 600.0, y2: 230.0 };
        let near = BoundingBox { x1: 540.0, y1: 150.0, x2: 700.0, y2: 300.0 };
        assert_eq!(observed(&car(far), &[far, near]).edges, [true, true, false, false]);
        // Projected cuboids are drawn behind other vehicles too.
        let label = Detection { convention: BoxConvention::ProjectedCuboid, ..car(far) };
        assert_eq!(observed(&label, &[far, near]).edges, [true; 4]);
    }

    #[test]
    fn occluded_edges_are_bounds() {
        let projected = BoundingBox::new([100.0, 100.0, 200.0, 160.0]);
        let observed = |x2: f64, edges| ObservedBox {
            bbox: BoundingBox::new([100.0, 100.0, x2, 160.0]),
            class: VehicleClass::Car,
            convention: BoxConvention::VisibleExtent,
            edges,
            pixel_size: 1.0,
            road_below: None,
        };
        assert!((overlap(&projected, &observed(120.0, [true; 4])) - 0.2).abs() < 1e-12);
        assert!((overlap(&projected, &observed(120.0, [true, true, false, true])) - 1.0).abs() < 1e-12);
        // The part of a box beyond the projected vehicle counts, hidden or not.
        assert!((overlap(&projected, &observed(300.0, [true, true, false, true])) - 0.5).abs() < 1e-12);
    }
}
