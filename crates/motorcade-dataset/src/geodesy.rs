//! Latitude and longitude, and the plane that touches the ellipsoid at a point. WGS 84 (NIMA TR8350.2, 2000).

use nalgebra::{Matrix3, Vector3};

/// Semi-major axis \[m\] and flattening.
const A_M: f64 = 6_378_137.0;
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// First eccentricity, squared.
const E2: f64 = FLATTENING * (2.0 - FLATTENING);

/// A point on or above the ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geodetic {
    /// Latitude \[deg\], north positive.
    pub latitude_deg: f64,
    /// Longitude \[deg\], east positive.
    pub longitude_deg: f64,
    /// Height above the ellipsoid \[m\].
    pub altitude_m: f64,
}

impl Geodetic {
    /// Earth-centred, earth-fixed coordinates \[m\].
    fn ecef(&self) -> Vector3<f64> {
        let ((sin_lat, cos_lat), (sin_lon, cos_lon)) =
            (self.latitude_deg.to_radians().sin_cos(), self.longitude_deg.to_radians().sin_cos());
        let n = A_M / (1.0 - E2 * sin_lat * sin_lat).sqrt();
        let across = (n + self.altitude_m) * cos_lat;
        Vector3::new(across * cos_lon, across * sin_lon, (n * (1.0 - E2) + self.altitude_m) * sin_lat)
    }

    fn from_ecef(p: &Vector3<f64>) -> Self {
        let across = p.x.hypot(p.y);
        // Fixed-point iteration on the latitude; it gains more than two digits a step anywhere near the surface.
        let mut latitude = p.z.atan2(across * (1.0 - E2));
        let mut altitude = 0.0;
        for _ in 0..8 {
            let (sin, cos) = latitude.sin_cos();
            let n = A_M / (1.0 - E2 * sin * sin).sqrt();
            // Stable at the poles and at the equator.
            altitude = across * cos + p.z * sin - A_M * (1.0 - E2 * sin * sin).sqrt();
            latitude = p.z.atan2(across * (1.0 - E2 * n / (n + altitude)));
        }
        Self {
            latitude_deg: latitude.to_degrees(),
            longitude_deg: p.y.atan2(p.x).to_degrees(),
            altitude_m: altitude,
        }
    }

    /// Rows east, north and up of the plane at this point.
    fn axes(&self) -> Matrix3<f64> {
        let ((sin_lat, cos_lat), (sin_lon, cos_lon)) =
            (self.latitude_deg.to_radians().sin_cos(), self.longitude_deg.to_radians().sin_cos());
        Matrix3::new(
            -sin_lon,
            cos_lon,
            0.0,
            -sin_lat * cos_lon,
            -sin_lat * sin_lon,
            cos_lat,
            cos_lat * cos_lon,
            cos_lat * sin_lon,
            sin_lat,
        )
    }

    /// East, north, up of another point from this one \[m\].
    pub fn local(&self, other: &Self) -> Vector3<f64> {
        self.axes() * (other.ecef() - self.ecef())
    }

    /// The point at east, north, up \[m\] from this one.
    pub fn moved(&self, local_m: &Vector3<f64>) -> Self {
        Self::from_ecef(&(self.ecef() + self.axes().transpose() * local_m))
    }

    /// True for numbers that a point on the earth has.
    pub fn is_valid(&self) -> bool {
        self.latitude_deg.abs() <= 90.0 && self.longitude_deg.abs() <= 180.0 && self.altitude_m.abs() < 1e5
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(latitude_deg: f64, longitude_deg: f64, altitude_m: f64) -> Geodetic {
        Geodetic { latitude_deg, longitude_deg, altitude_m }
    }

    #[test]
    fn known_points_have_known_coordinates() {
        let equator = point(0.0, 90.0, 0.0).ecef();
        assert!((equator - Vector3::new(0.0, A_M, 0.0)).norm() < 1e-6);
        let pole = point(90.0, 0.0, 10.0).ecef();
        assert!((pole - Vector3::new(0.0, 0.0, 6_356_752.314_245 + 10.0)).norm() < 1e-5);
        // A minute of latitude at the equator is 1842.9 m on WGS 84, at the pole 1861.6 m.
        let minute = |lat: f64| point(lat, 8.0, 0.0).local(&point(lat + 1.0 / 60.0, 8.0, 0.0)).y;
        assert!((minute(0.0) - 1842.9).abs() < 0.1 && (minute(89.9) - 1861.6).abs() < 0.1);
    }

    #[test]
    fn there_and_back() {
        for (lat, lon, alt) in
            [(49.0, 8.4, 115.0), (-33.9, 151.2, 20.0), (0.0, -179.9, 0.0), (71.0, 25.0, 400.0)]
        {
            let (start, way) = (point(lat, lon, alt), Vector3::new(1200.0, -3400.0, 25.0));
            let there = start.moved(&way);
            assert!((start.local(&there) - way).norm() < 1e-6, "{there:?}");
            let back = there.moved(&there.local(&start));
            assert!((back.latitude_deg - lat).abs() < 1e-10 && (back.altitude_m - alt).abs() < 1e-5);
        }
    }
}
