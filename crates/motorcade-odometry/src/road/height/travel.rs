//! Direction of travel in the camera's frame.

use nalgebra::Vector3;

/// Smoothed direction of travel.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Travel {
    mean: Option<Vector3<f64>>,
}

impl Travel {
    /// Adds a motion over `elapsed_s`, in the camera's frame; backwards counts as forwards.
    pub fn add(&mut self, motion: &Vector3<f64>, elapsed_s: f64, time_constant_s: f64) {
        let Some(direction) = motion.try_normalize(1e-9) else { return };
        let forwards = if direction.z < 0.0 { -direction } else { direction };
        let rate = 1.0 - (-elapsed_s / time_constant_s).exp();
        let mean = self.mean.map_or(forwards, |m| m + (forwards - m) * rate);
        self.mean = mean.try_normalize(1e-9);
    }

    /// Unit direction, after the first motion.
    pub fn direction(&self) -> Option<Vector3<f64>> {
        self.mean
    }

    /// Unit normal of the road, away from the camera, that holds the direction of travel and has no roll.
    pub fn down(&self) -> Option<Vector3<f64>> {
        self.mean.and_then(|d| (Vector3::y() - d * d.y).try_normalize(1e-9))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_road_holds_the_direction_of_travel() {
        let mut travel = Travel::default();
        assert!(travel.down().is_none());
        travel.add(&Vector3::new(0.1, -0.05, 2.0), 0.1, 1.0);
        travel.add(&Vector3::new(-0.1, 0.05, -2.0), 0.1, 1.0);
        let (down, direction) = (travel.down().unwrap(), travel.direction().unwrap());
        assert!(direction.z > 0.99 && down.dot(&direction).abs() < 1e-12);
        assert!((down.z / down.y - 0.025).abs() < 1e-3, "{down}");
    }
}
