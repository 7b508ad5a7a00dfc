//! Class of a vehicle: the detector's votes and the fit of its boxes.
//!
//! A detector that calls a van a car places it a quarter too near, while its lower edge says where it stands on the road. Both
//! cues are weighed: each class is a model with a size prior, and the models' evidence is compared (Bishop, Pattern Recognition and
//! Machine Learning, 2006, section 4.4.1).

use motorcade_perception::VehicleClass;

use super::hypothesis::TrackHypothesis;
use super::input::TrackInput;
use crate::options::ClassOptions;
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
        // A motorcycle is no car.
        votes.add_score(VehicleClass::Motorcycle, 0.1);
        assert!(others(&votes, VehicleClass::Car, &options).is_empty());
    }
}
