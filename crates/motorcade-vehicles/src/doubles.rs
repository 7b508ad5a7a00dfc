//! Two tracks on one vehicle.
//!
//! A detector that gives a vehicle two boxes (another class, the cab of a lorry) for seconds starts a second track on it. Two vehicles are
//! not seen in one place of the picture for most of their time.

use crate::options::HypothesisOptions;
use crate::trajectory::VehicleTrajectory;

/// The vehicles without those whose boxes lie on the boxes of another one most of the time; of the two the one with the larger sum of
/// scores stays.
pub fn without_doubles(
    mut vehicles: Vec<VehicleTrajectory>,
    options: &HypothesisOptions,
) -> Vec<VehicleTrajectory> {
    let evidence = |v: &VehicleTrajectory| v.states.iter().map(|s| s.score).sum::<f64>();
    let mut order: Vec<usize> = (0..vehicles.len()).collect();
    order.sort_by(|a, b| evidence(&vehicles[*b]).total_cmp(&evidence(&vehicles[*a])).then(a.cmp(b)));
    let mut kept: Vec<usize> = Vec::new();
    for index in order {
        if !kept.iter().any(|k| is_double(&vehicles[index], &vehicles[*k], options)) {
            kept.push(index);
        }
    }
    let mut index = 0;
    vehicles.retain(|_| {
        index += 1;
        kept.contains(&(index - 1))
    });
    vehicles
}

/// True when boxes of `weak` lie on those of `strong` in most frames that have one.
fn is_double(weak: &VehicleTrajectory, strong: &VehicleTrajectory, options: &HypothesisOptions) -> bool {
    let first = strong.states.first().map_or(0, |s| s.frame);
    let boxes = || weak.states.iter().filter_map(|s| Some((s.frame, s.bbox.filter(|_| s.score > 0.0)?)));
    let on_strong = boxes().filter(|(frame, bbox)| {
        let state = frame.checked_sub(first).and_then(|k| strong.states.get(k));
        state.and_then(|s| s.bbox).is_some_and(|other| other.iou(bbox) > options.double_iou)
    });
    let count = boxes().count();
    count > 0 && on_strong.count() as f64 > options.double_share * count as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::size_prior::size_prior;
    use crate::trajectory::{Source, VehicleState};
    use motorcade_geometry::{BoundingBox, Pose};
    use motorcade_perception::VehicleClass;
    use nalgebra::{Matrix3, Matrix6};

    fn vehicle(id: usize, frames: std::ops::Range<usize>, x_px: f64, score: f64) -> VehicleTrajectory {
        let state = |frame: usize| VehicleState {
            frame,
            world_from_vehicle: Pose::identity(),
            covariance: Matrix6::identity(),
            bbox: Some(BoundingBox::new([x_px, 100.0, x_px + 60.0, 150.0])),
            score,
            speed_mps: 0.0,
            speed_sigma_mps: 1.0,
            yaw_rate_radps: 0.0,
            source: Source::Box,
            measurement: None,
            observations: Vec::new(),
        };
        VehicleTrajectory {
            id,
            class: VehicleClass::Car,
            size: size_prior(VehicleClass::Car).mean,
            size_covariance: Matrix3::identity(),
            size_by_road: None,
            p_moving: 0.5,
            states: frames.map(state).collect(),
        }
    }

    fn ids(vehicles: Vec<VehicleTrajectory>) -> Vec<usize> {
        without_doubles(vehicles, &HypothesisOptions::default()).iter().map(|v| v.id).collect()
    }

    #[test]
    fn the_weaker_of_two_on_one_vehicle_goes() {
        // The second lies on the first, the third beside it, the fourth on it after its end.
        let all = vec![
            vehicle(1, 10..30, 200.0, 0.4),
            vehicle(2, 0..40, 205.0, 0.8),
            vehicle(3, 0..40, 240.0, 0.8),
            vehicle(4, 38..60, 205.0, 0.8),
        ];
        assert_eq!(ids(all), [2, 3, 4]);
        assert!(ids(Vec::new()).is_empty());
    }
}
