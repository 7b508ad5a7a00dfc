//! Standard deviations of box edges and of the road's height.

use motorcade_geometry::PinholeCamera;
use motorcade_perception::{BoxConvention, VehicleClass};

use crate::ground::GroundFrame;
use crate::observed_box::ObservedBox;
use crate::options::BoxFitOptions;

/// Standard deviation of a measured edge (0 to 3: left, top, right, bottom) \[px\].
pub(crate) fn edge_sigma_px(observed: &ObservedBox, edge: usize, options: &BoxFitOptions) -> f64 {
    let ObservedBox { bbox, class, convention, pixel_size, .. } = observed;
    let side = if edge.is_multiple_of(2) { bbox.width() } else { bbox.height() };
    let large = matches!(class, VehicleClass::Van | VehicleClass::Truck | VehicleClass::Bus);
    let share = if large && edge != 3 && *convention == BoxConvention::VisibleExtent {
        options.large_edge_sigma_share
    } else {
        options.edge_sigma_share
    };
    (options.edge_sigma_px * pixel_size).hypot(share * side)
}

/// Standard deviation of an edge whose predicted position is `offset_px` further right or down than the observed one \[px\]; `None`
/// where it is unconstrained.
///
/// Truncated or occluded edges are one-sided constraints with a larger sigma. Below an occluded bottom edge the vehicle's extent
/// is bounded, because its roof, as high as the camera, would not bound its depth. Top and bottom of a truncated car may belong to
/// a lower part of it.
pub(super) fn edge_deviation_px(
    camera: &PinholeCamera,
    observed: &ObservedBox,
    edge: usize,
    offset_px: f64,
    options: &BoxFitOptions,
) -> Option<f64> {
    let sigma = edge_sigma_px(observed, edge, options);
    let height = observed.bbox.height();
    let reaches = if edge < 2 { offset_px <= 0.0 } else { offset_px >= 0.0 };
    match (observed.edges[edge], reaches) {
        (true, true) if !edge.is_multiple_of(2) && observed.is_truncated_part(camera, options.border_px) => {
            Some(sigma.hypot(options.truncated_part_share * height))
        }
        (true, _) => Some(sigma),
        (false, false) => Some(options.one_sided_factor * sigma),
        (false, true) => {
            let occluded = edge == 3 && observed.ends_above_border(camera, options.border_px);
            occluded.then_some(options.occluded_extent_share * height)
        }
    }
}

/// Standard deviation of the road's height at a place (ahead, left) about [`GroundFrame::rise`] \[m\]: that of the road ahead, and cross-fall beside the own
/// lane.
pub(crate) fn road_height_sigma_m(
    ground: &GroundFrame,
    ahead_m: f64,
    left_m: f64,
    options: &BoxFitOptions,
) -> f64 {
    let change = options.road_slope_sigma_rad.hypot(ground.slope_change_sigma_rad);
    let slope = change * options.slope_lengths(ahead_m);
    let of_plane = options.road_height_sigma_m.hypot(ground.pitch_sigma_rad.hypot(slope) * ahead_m);
    // Beside the road the height by the way is as unsure as that of the plane.
    let aside = 1.0 - (-(options.beside_m(left_m) / options.way_reach_m).powi(2)).exp();
    let along = ground.road_ahead.map_or(of_plane, |road| {
        let of_way = road.sigma_m(ahead_m);
        (of_way * of_way + aside * (of_plane * of_plane - of_way * of_way).max(0.0)).sqrt()
    });
    along.hypot(options.level_sigma_m(left_m))
}
