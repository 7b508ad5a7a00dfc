//! Class of a vehicle: the detector's votes and the fit of its boxes.
//!
//! A detector that calls a van a car places it a quarter too near, while its lower edge says where it stands on the road. Both
//! cues are weighed: each class is a model with a size prior, and the models' evidence is compared (Bishop, Pattern Recognition and
//! Machine Learning, 2006, section 4.4.1).

use motorcade_perception::VehicleClass;
use nalgebra::Matrix3;

use super::hypothesis::TrackHypothesis;
use super::input::TrackInput;
use crate::joint_size::{SizeByRoad, scale_variance};
use crate::options::ClassOptions;
use crate::size_prior::size_prior;
use crate::track::ClassVotes;

/// Classes that are confused with each other, in the order of [`ClassOptions`].
const CLASSES: [VehicleClass; 4] =
    [VehicleClass::Car, VehicleClass::Van, VehicleClass::Truck, VehicleClass::Bus];

/// Logarithm of the probability of a class after the votes, up to a constant; `None` for one that the votes exclude. The boxes of a
/// vehicle look alike, so that all votes count as one.
pub(super) fn log_prior(votes: &ClassVotes, class: VehicleClass, options: &ClassOptions) -> Option<f64> {
    let index = |class: VehicleClass| CLASSES.iter().position(|known| *known == class);
    let row = index(class)?;
    let shares = votes.shares()?;
    let one = |(vote, share): (VehicleClass, f64)| match index(vote) {
        Some(column) => Some(share * options.confusion[row][column].ln()),
        None => (share == 0.0).then_some(0.0),
    };
    let votes: Option<f64> = VehicleClass::ALL.into_iter().zip(shares).map(one).sum();
    Some(options.shares[row].ln() + votes?)
}

/// Twice the negative logarithm of the evidence of a fit, without the class's own probability: the likelihood of boxes, road and
/// size, and by Laplace's approximation how much the boxes narrow the size prior.
pub(super) fn cost(input: &TrackInput<'_>, fit: &TrackHypothesis) -> f64 {
    let prior = input.prior.sigma.to_vector().map(|s| (s * s).ln()).sum();
    let posterior = fit.views.size.covariance.determinant().max(f64::MIN_POSITIVE).ln();
    fit.views.cost + prior - posterior
}

/// The other classes worth a try.
pub(super) fn others(votes: &ClassVotes, class: VehicleClass, options: &ClassOptions) -> Vec<VehicleClass> {
    let possible = |other: &VehicleClass| *other != class && log_prior(votes, *other, options).is_some();
    CLASSES.into_iter().filter(possible).collect()
}

/// Variance of the logarithm of a vehicle's size that the other classes add to that of its own one. Each class says how large the vehicle is and how probable
/// that is by the votes and by the road; the variance is that of their mixture about the estimate of its own class.
pub(super) fn spread(
    votes: &ClassVotes,
    class: VehicleClass,
    by_road: Option<&SizeByRoad>,
    options: &ClassOptions,
) -> f64 {
    let own = Scale::of(class, class);
    // The size by the road, relative to the mean of this class.
    let road = by_road.map(|road| (road.log_factor + Scale::of(road.class, class).mean, road.variance));
    let all = CLASSES.into_iter().filter_map(|class_of| {
        let scale = Scale::of(class_of, class);
        let log_evidence = log_prior(votes, class_of, options)? + scale.log_likelihood(road);
        Some((log_evidence, scale.with(road)))
    });
    let all: Vec<(f64, Scale)> = all.collect();
    let most = all.iter().map(|(log, _)| *log).fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = all.iter().map(|(log, _)| (log - most).exp()).sum();
    let own = own.with(road);
    let about_own =
        |(log, scale): &(f64, Scale)| (log - most).exp() * (scale.variance + (scale.mean - own.mean).powi(2));
    let variance = all.iter().map(about_own).sum::<f64>() / sum;
    if variance.is_finite() { (variance - own.variance).max(0.0) } else { 0.0 }
}

/// Size of vehicles of one class among those that the detector calls another one.
#[derive(Clone, Copy, Debug)]
pub struct SizeOfClass {
    /// Probability of the class.
    pub probability: f64,
    /// Logarithm of its mean size over that of what the detector calls it.
    pub log_factor: f64,
    /// Variance of the logarithm of its size.
    pub variance: f64,
}

/// Sizes of the vehicles that the detector calls `called`: a van called a car is a fifth larger than cars.
pub fn sizes_by_class(called: VehicleClass, options: &ClassOptions) -> Vec<SizeOfClass> {
    let votes = ClassVotes::of(called);
    let one = |class: VehicleClass| {
        let scale = Scale::of(class, called);
        let probability = log_prior(&votes, class, options)?.exp();
        Some(SizeOfClass { probability, log_factor: scale.mean, variance: scale.variance })
    };
    let mut all: Vec<SizeOfClass> = CLASSES.into_iter().filter_map(one).collect();
    let sum: f64 = all.iter().map(|size| size.probability).sum();
    all.iter_mut().for_each(|size| size.probability /= sum);
    all
}

/// Logarithm of the size of vehicles of a class over the mean size of another one.
#[derive(Clone, Copy)]
struct Scale {
    mean: f64,
    variance: f64,
}

impl Scale {
    /// The factor on the mean size of `other` that is nearest to the mean size of `class`, by the other's standard deviations.
    fn of(class: VehicleClass, other: VehicleClass) -> Self {
        let [own, other] = [class, other].map(size_prior);
        let [d, e] = [own.mean.to_vector(), other.mean.to_vector()];
        let [covariance, weights] =
            [own.sigma.to_vector().map(|s| s * s), other.sigma.to_vector().map(|s| 1.0 / (s * s))];
        let factor = e.component_mul(&weights).dot(&d) / e.component_mul(&weights).dot(&e);
        let variance = scale_variance(&own.mean, &Matrix3::from_diagonal(&covariance));
        Self { mean: factor.ln(), variance }
    }

    /// With what the road says (mean, variance).
    fn with(self, road: Option<(f64, f64)>) -> Self {
        let Some((mean, variance)) = road else { return self };
        let gain = self.variance / (self.variance + variance);
        Self { mean: self.mean + gain * (mean - self.mean), variance: self.variance * (1.0 - gain) }
    }

    /// Of what the road says, up to a constant.
    fn log_likelihood(self, road: Option<(f64, f64)>) -> f64 {
        road.map_or(0.0, |(mean, variance)| {
            let sum = self.variance + variance;
            -0.5 * ((mean - self.mean).powi(2) / sum + sum.ln())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn votes_and_traffic_make_the_prior() {
        let (mut votes, options) = (ClassVotes::default(), ClassOptions::default());
        assert!(log_prior(&votes, VehicleClass::Car, &options).is_none());
        votes.add_score(VehicleClass::Car, 0.9);
        let of = |votes: &ClassVotes, class| log_prior(votes, class, &options).unwrap();
        assert!(of(&votes, VehicleClass::Car) > of(&votes, VehicleClass::Van) + 2.0);
        votes.add_score(VehicleClass::Truck, 9.0);
        assert!(of(&votes, VehicleClass::Truck) > of(&votes, VehicleClass::Bus));
        // Without a road a vehicle called a car may be a van or a lorry; a road that says so or denies it is sure of it.
        let mut called_car = ClassVotes::default();
        called_car.add_score(VehicleClass::Car, 0.9);
        let by_road = |log_factor: f64, sigma: f64| SizeByRoad {
            class: VehicleClass::Car,
            views: 9.0,
            log_factor,
            variance: sigma * sigma,
            beside_m: 0.0,
        };
        let sigma =
            |road: Option<SizeByRoad>| spread(&called_car, VehicleClass::Car, road.as_ref(), &options).sqrt();
        assert!((0.07..0.1).contains(&sigma(None)), "{}", sigma(None));
        assert!((sigma(Some(by_road(0.0, 10.0))) - sigma(None)).abs() < 1e-3);
        assert!(sigma(Some(by_road(0.0, 0.02))) < 0.002, "{}", sigma(Some(by_road(0.0, 0.02))));
        assert!(sigma(Some(by_road(0.0, 0.2))) < 0.8 * sigma(None));
        // Of what is called a car one in sixteen is a van.
        let sizes = sizes_by_class(VehicleClass::Car, &options);
        assert!((sizes.iter().map(|size| size.probability).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(
            sizes[0].log_factor.abs() < 1e-12 && (0.18..0.24).contains(&sizes[1].log_factor),
            "{sizes:?}"
        );
        assert!((0.05..0.08).contains(&sizes[1].probability), "{sizes:?}");
        // A motorcycle is no car.
        votes.add_score(VehicleClass::Motorcycle, 0.1);
        assert!(others(&votes, VehicleClass::Car, &options).is_empty());
    }
}
