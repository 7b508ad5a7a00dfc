//! Position of a static vehicle.

use nalgebra::{Matrix3, Vector3};

use crate::motion::PositionMeasurement;
use crate::options::AdvancedVehicleOptions;
use crate::time::independent_views;

/// Information-weighted mean of the positions of a static vehicle, and its covariance (3×3). Frames of one track share their
/// errors (size, plane), so the covariance is that of a few independent views.
pub fn static_position(
    positions: &[PositionMeasurement],
    options: &AdvancedVehicleOptions,
) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let (mut information, mut sum) = (Matrix3::zeros(), Vector3::zeros());
    for measured in positions {
        let inverse = measured.covariance.try_inverse()?;
        information += inverse;
        sum += inverse * measured.position;
    }
    let covariance = information.try_inverse()?;
    let (first, last) = (positions.first()?, positions.last()?);
    let independent = independent_views(
        positions.len(),
        last.time_s - first.time_s,
        options.correlation_time_s,
        options.motion.static_independent_views,
    );
    Some((covariance * sum, covariance * (positions.len() as f64 / independent)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::kinematic_state::tests::positions;

    #[test]
    fn many_views_count_as_a_few() {
        let options = AdvancedVehicleOptions::default();
        let (position, covariance) = static_position(&positions(0.0), &options).unwrap();
        assert!((position - Vector3::new(2.0, 1.6, 20.0)).norm() < 1e-9);
        assert!(
            (covariance - Matrix3::identity() * 0.09 / options.motion.static_independent_views).norm() < 1e-9
        );
    }
}
