//! Class of a vehicle: the detector's votes and the fit of its boxes.
//!
//! A detector that calls a van a car places it a quarter too near, while its lower edge says where it stands on the road. Both
//! cues are weighed: each class is a model with a size prior, and the models' evidence is compared (Bishop, Pattern Recognition and
//! Machine Learning, 2006, section 4.4.1).

use motorcade_perception::VehicleClass;

use super::hypothesis::TrackHypothesis;
use super::input::TrackInput;
use crate::track::ClassVotes;

/// Classes that are confused with each other, with their share of the traffic: KITTI's labels have 28 742 cars, 2 914 vans and
/// 1 094 trucks (buses are among `Misc`; the figure is a guess).
const SHARES: [(VehicleClass, f64); 4] = [
    (VehicleClass::Car, 0.86),
    (VehicleClass::Van, 0.09),
    (VehicleClass::Truck, 0.04),
    (VehicleClass::Bus, 0.01),
];

/// Probability of a detector's class (column: car, van, truck, bus) for a vehicle's class (row, in the order of [`SHARES`]). Our
/// network calls 40 to 53 % of the lorries in its validation images lorries and 90 to 96 % of the cars cars; it knows no vans. A
/// detector that knows vans finds most of them. Each number is that of the kind of detector that gives such votes, so that rows of vans,
/// lorries and buses sum to more than one.
const CONFUSION: [[f64; 4]; 4] =
    [[0.94, 0.02, 0.05, 0.01], [0.60, 0.80, 0.30, 0.05], [0.40, 0.10, 0.50, 0.10], [0.15, 0.05, 0.25, 0.60]];

/// Logarithm of the probability of a class after the votes, up to a constant; `None` for one that the votes exclude. The boxes of a
/// vehicle look alike, so that all votes count as one.
pub(super) fn log_prior(votes: &ClassVotes, class: VehicleClass) -> Option<f64> {
    let row = SHARES.iter().position(|(known, _)| *known == class)?;
    let shares = votes.shares()?;
    let column = |vote: VehicleClass| SHARES.iter().position(|(known, _)| *known == vote);
    let one = |(vote, share): (VehicleClass, f64)| match column(vote) {
        Some(column) => Some(share * CONFUSION[row][column].ln()),
        None => (share == 0.0).then_some(0.0),
    };
    let votes: Option<f64> = VehicleClass::ALL.into_iter().zip(shares).map(one).sum();
    Some(SHARES[row].1.ln() + votes?)
}

/// Twice the negative logarithm of the evidence of a fit, without the class's own probability: the likelihood of boxes, road and
/// size, and by Laplace's approximation how much the boxes narrow the size prior.
pub(super) fn cost(input: &TrackInput<'_>, fit: &TrackHypothesis) -> f64 {
    let prior = input.prior.sigma.to_vector().map(|s| (s * s).ln()).sum();
    let posterior = fit.views.size.covariance.determinant().max(f64::MIN_POSITIVE).ln();
    fit.views.cost + prior - posterior
}

/// The other classes worth a try.
pub(super) fn others(votes: &ClassVotes, class: VehicleClass) -> Vec<VehicleClass> {
    let known = SHARES.iter().map(|(known, _)| *known);
    known.filter(|other| *other != class && log_prior(votes, *other).is_some()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn votes_and_traffic_make_the_prior() {
        let mut votes = ClassVotes::default();
        assert!(log_prior(&votes, VehicleClass::Car).is_none());
        votes.add_score(VehicleClass::Car, 0.9);
        let of = |votes: &ClassVotes, class| log_prior(votes, class).unwrap();
        assert!(of(&votes, VehicleClass::Car) > of(&votes, VehicleClass::Van) + 2.0);
        votes.add_score(VehicleClass::Truck, 9.0);
        assert!(of(&votes, VehicleClass::Truck) > of(&votes, VehicleClass::Bus));
        // A motorcycle is no car.
        votes.add_score(VehicleClass::Motorcycle, 0.1);
        assert!(others(&votes, VehicleClass::Car).is_empty());
    }
}
