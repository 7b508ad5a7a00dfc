//! Height of the camera by the sizes of vehicles.
//!
//! All lengths are proportional to the height. A car that stands on the road at the distance of its tyres is as large as cars are
//! if the height is right; if the height is stated a tenth too great, cars come out a tenth too large.

use motorcade_geometry::robust::median;
use motorcade_perception::VehicleClass;
use motorcade_vehicles::{ClassOptions, SizeOfClass, VehicleTrajectory, sizes_by_class};

use crate::estimator_options::VehicleHeightOptions;

/// Rounds of reweighting.
const ROUNDS: usize = 20;

/// The camera's height by vehicles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightByVehicles {
    /// Logarithm of the height over the one that was assumed.
    pub log_factor: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Vehicles that it was estimated from.
    pub vehicles: usize,
}

impl HeightByVehicles {
    /// The height by vehicles whose size is known by the road, where `assumed_m` was taken for it; `None` when there are none.
    /// A vehicle called a car may be a van or a lorry: each is a mixture of the classes, whose probabilities are estimated with the height
    /// (expectation maximisation). Outliers (wrong headings, parts of vehicles) have little weight: Student's t about each class. So have boxes of low
    /// scores, many of which are no vehicles.
    pub fn new(
        vehicles: &[VehicleTrajectory],
        assumed_m: f64,
        options: &VehicleHeightOptions,
        classes: &ClassOptions,
    ) -> Option<Self> {
        let scores: Vec<f64> = vehicles.iter().map(mean_score).collect();
        let best = scores.iter().copied().fold(0.0, f64::max);
        let sized = |(v, score): (&VehicleTrajectory, &f64)| {
            let size = v.size_by_road.filter(|size| size.class == VehicleClass::Car)?;
            let enough = size.views >= options.advanced.least_views
                && size.variance.sqrt() < options.advanced.most_sigma;
            let level_sigma = options.advanced.cross_fall_sigma_rad * size.beside_m / assumed_m;
            let variance = size.variance + options.advanced.vehicle_sigma.powi(2) + level_sigma.powi(2);
            let certainty = if best > 0.0 { (score / best).powi(2) } else { 1.0 };
            let sized = Sized { log_factor: size.log_factor, variance, certainty };
            (enough && certainty > 0.0).then_some(sized)
        };
        let sizes: Vec<Sized> = vehicles.iter().zip(&scores).filter_map(sized).collect();
        let classes = sizes_by_class(VehicleClass::Car, classes);
        let mut factors: Vec<f64> = sizes.iter().map(|size| size.log_factor).collect();
        let mut mean = median(&mut factors)?;
        let mut sum = 0.0;
        for _ in 0..ROUNDS {
            let all =
                sizes.iter().flat_map(|size| size.by_class(mean, &classes, options.advanced.kernel_sigmas));
            let (weights, weighted) =
                all.fold((0.0, 0.0), |(w, x), (weight, at)| (w + weight, x + weight * at));
            (mean, sum) = (weighted / weights, weights);
        }
        let advanced = &options.advanced;
        let few = if sizes.len() < advanced.least_vehicles { advanced.few_vehicles_factor } else { 1.0 };
        let sigma = few * (1.0 / sum).sqrt().hypot(options.common_sigma);
        // Vehicles that look too large mean a height that is stated too great.
        Some(Self { log_factor: -mean, sigma, vehicles: sizes.len() })
    }

    /// An estimate by few vehicles combined with the guess of a height of which nothing is known.
    pub(crate) fn with_guess(self, assumed_m: f64, options: &VehicleHeightOptions) -> Self {
        if self.vehicles >= options.advanced.least_vehicles {
            return self;
        }
        let (guess, vehicles) = (options.guess_sigma.powi(-2), self.sigma.powi(-2));
        let guess_factor = (options.guess_m / assumed_m).ln();
        let log_factor = (guess * guess_factor + vehicles * self.log_factor) / (guess + vehicles);
        Self { log_factor, sigma: (guess + vehicles).powf(-0.5), ..self }
    }

    /// A warning where a stated height (m) disagrees.
    pub fn disagreement(&self, stated_m: f64, options: &VehicleHeightOptions) -> Option<String> {
        let surprising = self.log_factor.abs() > options.advanced.disagreement_sigmas * self.sigma;
        (surprising && self.vehicles >= options.advanced.least_for_disagreement).then(|| {
            let (height_m, sigma_m) = self.metres(stated_m);
            format!(
                "the height {stated_m:.2} m disagrees with {} vehicles: they say {height_m:.2} ± {sigma_m:.2} m; all lengths are \
                 proportional to it",
                self.vehicles
            )
        })
    }

    /// Combines a stated height, whose logarithm has the standard deviation `stated_sigma`, with vehicles that say `log_factor` times it.
    /// Returns the logarithm of the factor on the stated height and its standard deviation. Where both disagree one of them is wrong, and
    /// the standard deviation is half of what they are apart.
    pub(crate) fn combined(&self, stated_sigma: f64, options: &VehicleHeightOptions) -> (f64, f64) {
        let (stated, vehicles) = (stated_sigma.powi(-2), self.sigma.powi(-2));
        let sigma = (stated + vehicles).powf(-0.5);
        let apart = self.log_factor.abs();
        let disagree = apart > options.advanced.disagreement_sigmas * stated_sigma.hypot(self.sigma);
        let log_factor = vehicles * self.log_factor / (stated + vehicles);
        (log_factor, if disagree { sigma.max(0.5 * apart) } else { sigma })
    }

    /// Height and standard deviation \[m\] for the one that was assumed.
    pub fn metres(&self, assumed_m: f64) -> (f64, f64) {
        let height_m = assumed_m * self.log_factor.exp();
        (height_m, height_m * self.sigma)
    }
}

/// Size of a vehicle by the road.
struct Sized {
    /// Logarithm of the factor on the mean size of cars.
    log_factor: f64,
    /// Variance of it about the mean of all, were it a car.
    variance: f64,
    /// Weight by the score of its boxes.
    certainty: f64,
}

impl Sized {
    /// For each class that it may be of its weight and the factor that cars then have, near `mean`. Student's t of `kernel_sigmas`² degrees of freedom.
    fn by_class(&self, mean: f64, classes: &[SizeOfClass], kernel_sigmas: f64) -> Vec<(f64, f64)> {
        let dof = kernel_sigmas * kernel_sigmas;
        let car = classes.first().map_or(0.0, |car| car.variance);
        let one = |class: &SizeOfClass| {
            let variance = self.variance + (class.variance - car).max(0.0);
            let at = self.log_factor - class.log_factor;
            let tail = 1.0 + (at - mean).powi(2) / (dof * variance);
            let density = class.probability * tail.powf(-0.5 * (dof + 1.0)) / variance.sqrt();
            (density, self.certainty / (variance * tail), at)
        };
        let all: Vec<(f64, f64, f64)> = classes.iter().map(one).collect();
        let sum: f64 = all.iter().map(|(density, ..)| density).sum();
        all.into_iter().map(|(density, weight, at)| (weight * density / sum, at)).collect()
    }
}

/// Mean score of the boxes of a vehicle; a predicted one has none.
fn mean_score(vehicle: &VehicleTrajectory) -> f64 {
    let scores = || vehicle.states.iter().map(|s| s.score).filter(|score| *score > 0.0);
    scores().sum::<f64>() / scores().count().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::Pose;
    use motorcade_vehicles::{SizeByRoad, Source, VehicleState, size_prior};
    use nalgebra::{Matrix3, Matrix6};

    fn car(id: usize, log_factor: f64) -> VehicleTrajectory {
        VehicleTrajectory {
            id,
            class: VehicleClass::Car,
            size: size_prior(VehicleClass::Car).mean,
            size_covariance: Matrix3::identity() * 0.01,
            size_by_road: Some(SizeByRoad {
                class: VehicleClass::Car,
                views: 20.0,
                log_factor,
                variance: 0.0025,
                beside_m: 0.0,
            }),
            p_moving: 0.5,
            states: Vec::new(),
        }
    }

    fn scored(vehicle: VehicleTrajectory, score: f64) -> VehicleTrajectory {
        let state = VehicleState {
            frame: 0,
            world_from_vehicle: Pose::identity(),
            covariance: Matrix6::identity(),
            bbox: None,
            score,
            speed_mps: 0.0,
            speed_sigma_mps: 1.0,
            yaw_rate_radps: 0.0,
            source: Source::Box,
            measurement: None,
            observations: Vec::new(),
            heading_variance: 0.0,
            rival: None,
        };
        VehicleTrajectory { states: vec![state], ..vehicle }
    }

    #[test]
    fn a_wrong_height_is_reported_in_spite_of_outliers() {
        let options = VehicleHeightOptions::default();
        let mut cars: Vec<VehicleTrajectory> =
            (0..14).map(|k| car(k, 0.3 + 0.02 * (k % 5) as f64 - 0.04)).collect();
        cars.extend([car(14, 1.4), car(15, -0.9)]);
        let found = HeightByVehicles::new(&cars, 1.65, &options, &ClassOptions::default()).unwrap();
        assert!((found.log_factor + 0.3).abs() < 0.03, "{found:?}");
        let (height_m, sigma_m) = found.metres(1.65);
        assert!((height_m - 1.65 * (-0.3_f64).exp()).abs() < sigma_m, "{found:?}");
        let warning = found.disagreement(1.65, &options).unwrap();
        assert!(warning.contains("1.65 m disagrees with 16 vehicles"), "{warning}");
    }

    /// Boxes on a wall, and cars on a parallel road that lies higher.
    #[test]
    fn doubtful_boxes_and_distant_lanes_weigh_little() {
        let options = VehicleHeightOptions::default();
        let with = |score: f64, beside_m: f64| {
            let odd = |k: usize| {
                let mut car = scored(car(k, -0.35), score);
                if let Some(size) = &mut car.size_by_road {
                    size.beside_m = beside_m;
                }
                car
            };
            let cars: Vec<VehicleTrajectory> =
                (0..4).map(|k| scored(car(k, 0.0), 0.85)).chain((4..8).map(odd)).collect();
            HeightByVehicles::new(&cars, 1.65, &options, &ClassOptions::default()).unwrap()
        };
        let (same, doubtful, distant) = (with(0.85, 0.0), with(0.3, 0.0), with(0.85, 12.0));
        assert!(same.log_factor > 0.1, "{same:?}");
        assert!(doubtful.log_factor < 0.06 && distant.log_factor < 0.06, "{doubtful:?} {distant:?}");
    }

    #[test]
    fn a_stated_height_and_vehicles_are_combined_by_their_variances() {
        let options = VehicleHeightOptions::default();
        let vehicles = |log_factor: f64| HeightByVehicles { log_factor, sigma: 0.06, vehicles: 12 };
        let (log_factor, sigma) = vehicles(0.1).combined(0.08, &options);
        assert!((log_factor - 0.1 * 0.64).abs() < 1e-12, "{log_factor}");
        assert!((sigma - 0.048).abs() < 1e-12, "{sigma}");
        let (_, apart) = vehicles(-0.4).combined(0.08, &options);
        assert!((apart - 0.2).abs() < 1e-12, "{apart}");
    }

    #[test]
    fn few_vehicles_move_the_guess_by_their_variance() {
        let options = VehicleHeightOptions::default();
        let by = |count: usize| {
            let cars: Vec<VehicleTrajectory> = (0..count).map(|k| car(k, 0.3)).collect();
            HeightByVehicles::new(&cars, options.guess_m, &options, &ClassOptions::default())
                .unwrap()
                .with_guess(options.guess_m, &options)
        };
        let (one, two, three) = (by(1), by(2), by(3));
        assert!(-0.3 < three.log_factor + 1e-9 && two.log_factor > -0.3 && one.log_factor > two.log_factor);
        assert!(one.log_factor < -0.15 && one.sigma < options.guess_sigma, "{one:?}");
        assert!(two.sigma < one.sigma && three.sigma < 0.6 * two.sigma, "{two:?} {three:?}");
    }

    #[test]
    fn no_vehicles_and_right_heights_say_nothing() {
        let options = VehicleHeightOptions::default();
        assert_eq!(HeightByVehicles::new(&[], 1.65, &options, &ClassOptions::default()), None);
        let cars: Vec<VehicleTrajectory> = (0..12).map(|k| car(k, 0.06)).collect();
        let found = HeightByVehicles::new(&cars, 1.65, &options, &ClassOptions::default()).unwrap();
        assert_eq!(found.disagreement(1.2, &options), None);
    }
}
