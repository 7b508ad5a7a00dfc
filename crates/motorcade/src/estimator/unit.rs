//! The unit of an external trajectory where no road was measured. Positions of vehicles relative to the camera are metric, so a
//! static vehicle gives the distance between two cameras that see it.
//!
//! Static vehicles agree on the unit; each moving one implies another unit. Ambiguity: oncoming traffic that is all as fast as
//! the camera agrees on twice the unit.

use std::collections::BTreeMap;

use motorcade_geometry::{Camera, Pose, World};
use motorcade_vehicles::VehicleTrajectory;
use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector3, Vector4};

use crate::estimator_options::UnitOptions;

/// Slack for times rounded to nanoseconds \[s\].
const ROUNDING_S: f64 = 1e-6;

/// Metres a unit of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Unit {
    pub(crate) metres: f64,
    /// Relative standard deviation.
    pub(crate) sigma: f64,
    /// Vehicles that agree on it.
    pub(crate) vehicles: usize,
}

impl std::fmt::Display for Unit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { metres, sigma, vehicles } = self;
        let percent = 100.0 * sigma;
        write!(
            f,
            "no road was seen: a unit of the trajectory is taken for {metres:.3} m ± {percent:.0} %, because {vehicles} vehicles "
        )?;
        write!(f, "then stand; were these oncoming traffic, lengths would be too large")
    }
}

/// Estimates of the unit by vehicle; each vehicle is taken for static.
#[derive(Clone, Debug)]
pub(crate) struct UnitEstimator {
    options: UnitOptions,
    by_vehicle: BTreeMap<usize, UnitEstimate>,
}

/// State of an estimator between two frames.
pub(crate) type UnitState = BTreeMap<usize, UnitEstimate>;

impl UnitEstimator {
    /// The state after the last frame.
    pub(crate) fn state(&self) -> UnitState {
        let Self { options: _, by_vehicle } = self;
        by_vehicle.clone()
    }

    /// As in a state, with the options of this one.
    pub(crate) fn resumed(self, by_vehicle: UnitState) -> Self {
        Self { by_vehicle, ..self }
    }

    /// Without vehicles.
    pub(crate) fn new(options: UnitOptions) -> Self {
        Self { options, by_vehicle: BTreeMap::new() }
    }

    /// Takes the vehicles of a window whose frames, one every `interval_s`, have these camera poses in units of the trajectory. Of
    /// several estimates by one vehicle the most certain is kept.
    pub(crate) fn update(
        &mut self,
        vehicles: &[VehicleTrajectory],
        world_from_camera: &[Pose<World, Camera>],
        interval_s: f64,
    ) {
        for vehicle in vehicles {
            let new = of_vehicle(vehicle, world_from_camera, interval_s, &self.options);
            let Some(new) = new else { continue };
            let kept = self.by_vehicle.entry(vehicle.id).or_insert(new);
            if new.sigma < kept.sigma {
                *kept = new;
            }
        }
    }

    /// The unit that most vehicles agree on; `None` where too few do.
    pub(crate) fn unit(&self) -> Option<Unit> {
        let all: Vec<UnitEstimate> = self.by_vehicle.values().copied().collect();
        let agreeing = |one: &UnitEstimate| all.iter().filter(|o| o.agrees(one)).copied().collect::<Vec<_>>();
        let best = all.iter().map(agreeing).max_by(|a, b| information(a).total_cmp(&information(b)))?;
        let mean = best.iter().map(|t| t.ln_metres / t.sigma.powi(2)).sum::<f64>() / information(&best);
        let sigma = (1.0 / information(&best)).sqrt().hypot(self.options.common_sigma);
        (best.len() >= self.options.least_vehicles).then(|| Unit {
            metres: mean.exp(),
            sigma,
            vehicles: best.len(),
        })
    }
}

/// The unit that most vehicles of a drive agree on; `None` where too few do.
pub(crate) fn of(
    vehicles: &[VehicleTrajectory],
    world_from_camera: &[Pose<World, Camera>],
    interval_s: f64,
    options: &UnitOptions,
) -> Option<Unit> {
    let mut units = UnitEstimator::new(*options);
    units.update(vehicles, world_from_camera, interval_s);
    units.unit()
}

fn information(estimates: &[UnitEstimate]) -> f64 {
    estimates.iter().map(|t| t.sigma.powi(-2)).sum()
}

/// Unit by one vehicle, taken for static.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct UnitEstimate {
    ln_metres: f64,
    sigma: f64,
}

impl UnitEstimate {
    fn agrees(&self, other: &Self) -> bool {
        (self.ln_metres - other.ln_metres).abs() < 2.0 * self.sigma.hypot(other.sigma)
    }
}

/// Least squares for unit s and place P of a standing vehicle seen at p from cameras (R, t): R p + s t = P.
fn of_vehicle(
    vehicle: &VehicleTrajectory,
    world_from_camera: &[Pose<World, Camera>],
    interval_s: f64,
    options: &UnitOptions,
) -> Option<UnitEstimate> {
    let (mut h, mut g, mut views) = (Matrix4::zeros(), Vector4::zeros(), 0_u32);
    let correlated_views = (options.correlation_time_s / interval_s).max(1.0);
    let origin = world_from_camera.get(vehicle.states.first()?.frame)?.translation();
    for state in &vehicle.states {
        let (Some(measurement), Some(camera)) = (state.measurement, world_from_camera.get(state.frame))
        else {
            continue;
        };
        let place = camera.transform_vector(&measurement.camera_from_vehicle.translation());
        let turn = camera.rotation_matrix() * measurement.camera_from_vehicle.rotation_matrix();
        let covariance = turn * measurement.covariance.fixed_view::<3, 3>(3, 3) * turn.transpose();
        let weight = (covariance * correlated_views).try_inverse()?;
        let way: Vector3<f64> = camera.translation() - origin;
        let mut j = Matrix3x4::zeros();
        j.set_column(0, &way);
        j.fixed_view_mut::<3, 3>(0, 1).copy_from(&-Matrix3::identity());
        h += j.transpose() * weight * j;
        g -= j.transpose() * weight * place;
        views += 1;
    }
    let inverse = h.try_inverse()?;
    let metres = (inverse * g)[0];
    let sigma = (inverse[(0, 0)].max(0.0).sqrt() / metres).hypot(options.vehicle_sigma);
    let seen_s = f64::from(views.saturating_sub(1)) * interval_s;
    let certain = seen_s > options.least_s - ROUNDING_S && metres > 0.0 && sigma < options.most_sigma;
    certain.then(|| UnitEstimate { ln_metres: metres.ln(), sigma })
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::Vehicle;
    use motorcade_perception::VehicleClass;
    use motorcade_vehicles::{Dimensions, Source, VehicleMeasurement, VehicleState};
    use nalgebra::{Matrix6, UnitQuaternion};

    /// The camera drives 1 m a frame, in a unit of 2.5 m.
    const UNIT_M: f64 = 2.5;

    fn way() -> Vec<Pose<World, Camera>> {
        let at = |k: u32| Vector3::new(0.0, 0.0, f64::from(k) / UNIT_M);
        (0..20).map(|k| Pose::from_parts(UnitQuaternion::identity(), at(k))).collect()
    }

    /// At x, z when it is first seen, with its own speed \[m a frame\]; distances too large by a share.
    fn vehicle(x: f64, z: f64, speed: f64, share: f64) -> VehicleTrajectory {
        let state = |k: u32| {
            let place = Vector3::new(x, 1.65, z + (speed - 1.0) * f64::from(k)) * (1.0 + share);
            let pose: Pose<Camera, Vehicle> = Pose::from_parts(UnitQuaternion::identity(), place);
            VehicleState {
                frame: k as usize,
                world_from_vehicle: Pose::identity(),
                covariance: Matrix6::identity(),
                bbox: None,
                score: 0.9,
                speed_mps: 0.0,
                speed_sigma_mps: 1.0,
                yaw_rate_radps: 0.0,
                source: Source::Box,
                measurement: Some(VehicleMeasurement {
                    camera_from_vehicle: pose,
                    covariance: Matrix6::identity() * 0.01,
                }),
                observations: Vec::new(),
                heading_variance: 0.0,
                rival: None,
            }
        };
        VehicleTrajectory {
            id: 1,
            class: VehicleClass::Car,
            size: Dimensions { length_m: 4.2, width_m: 1.7, height_m: 1.5 },
            size_covariance: Matrix3::identity() * 0.01,
            size_by_road: None,
            p_moving: 0.5,
            states: (0..20).map(state).collect(),
        }
    }

    #[test]
    fn static_vehicles_agree_on_the_unit() {
        let parked =
            [vehicle(3.0, 30.0, 0.0, 0.03), vehicle(-4.0, 40.0, 0.0, -0.04), vehicle(4.0, 45.0, 0.0, 0.0)];
        let traffic =
            [vehicle(0.0, 15.0, 1.0, 0.0), vehicle(-3.0, 60.0, -1.3, 0.0), vehicle(-3.0, 60.0, -0.8, 0.0)];
        let numbered = |(id, v): (usize, &VehicleTrajectory)| VehicleTrajectory { id, ..v.clone() };
        let all: Vec<_> = parked.iter().chain(&traffic).enumerate().map(numbered).collect();
        let found = of(&all, &way(), 0.1, &UnitOptions::default()).unwrap();
        assert_eq!(found.vehicles, 3);
        assert!((found.metres / UNIT_M).ln().abs() < 0.03 && found.sigma < 0.12, "{found:?}");
        // As many views in a fifth of the time are too short to determine it, or determine it less well.
        assert_eq!(of(&all, &way(), 0.02, &UnitOptions::default()), None);
        let short = UnitOptions { least_s: 0.2, ..UnitOptions::default() };
        let hasty = of(&all, &way(), 0.02, &short).unwrap();
        assert!(hasty.sigma > found.sigma, "{hasty:?} {found:?}");
        // Two that agree may both be oncoming traffic.
        assert_eq!(of(&all[1..], &way(), 0.1, &UnitOptions::default()), None);
    }
}
