//! Scale by a sensor other than the camera.

/// Scale of the odometry by a sensor that measures distances: wheels, a GPS receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleMeasurement {
    /// Frame it belongs to.
    pub frame: usize,
    /// Logarithm of metres per unit.
    pub log_scale: f64,
    /// Its variance, without what all measurements of the sensor share.
    pub variance: f64,
}
