//! Options of rendering, and of the simulated detector.

use motorcade_geometry::PinholeCamera;
use nalgebra::Vector3;

use crate::error::{Error, Result};
use crate::weather::Weather;

/// Style of vehicles and light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Look {
    /// One style of lamps, glass and light for all.
    #[default]
    Plain,
    /// Style of every vehicle and the light of the scene drawn from the seed; for training data.
    Varied,
}

/// Noise, exposure and motion blur of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorOptions {
    /// Standard deviation of the noise of a pixel \[grey levels of 255\].
    pub noise: f64,
    /// Relative amplitude of slow changes of exposure; 0 for none.
    pub exposure_drift: f64,
    /// Shutter time \[s\]; seen only with more than one blur sample.
    pub shutter_s: f64,
    /// Pictures averaged over the shutter time, whose middle is the time of the frame; 1 for no motion blur. The cost is proportional
    /// to it, for even numbers to one picture more.
    pub blur_samples: usize,
    /// Time from the reading of the first row to that of the last \[s\], of a rolling shutter; the middle row has the time of the frame. 0
    /// for a global shutter. Not with blur.
    pub readout_s: f64,
}

impl Default for SensorOptions {
    fn default() -> Self {
        Self { noise: 1.5, exposure_drift: 0.03, shutter_s: 0.006, blur_samples: 1, readout_s: 0.0 }
    }
}

/// Camera, rate, weather and sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOptions {
    /// Intrinsics and size; KITTI's by default.
    pub camera: PinholeCamera,
    /// Frames per second.
    pub fps: f64,
    /// The weather.
    pub weather: Weather,
    /// The sensor.
    pub sensor: SensorOptions,
    /// Style of vehicles and light.
    pub look: Look,
    /// Time of day \[h\], 6 to 18: where the sun stands in [`Look::Plain`].
    pub hour: f64,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            camera: PinholeCamera { fx: 721.5, fy: 721.5, cx: 609.5, cy: 172.9, width: 1242, height: 375 },
            fps: 10.0,
            weather: Weather::Clear,
            sensor: SensorOptions::default(),
            look: Look::Plain,
            hour: NOON_H,
        }
    }
}

/// Hour at which the sun is highest.
const NOON_H: f64 = 12.0;
/// Towards the sun at that hour, in the site.
const NOON_SUN: [f64; 3] = [0.45, -0.55, 0.70];
/// Towards the low sun of [`Weather::LowSun`], in the site: 15° left of x, 8° high.
const LOW_SUN: [f64; 3] = [0.9565, 0.2563, 0.1392];

impl RenderOptions {
    /// Towards the sun, in the site: it goes round by 15° an hour and sinks towards the horizon.
    pub(crate) fn sun(&self) -> Vector3<f64> {
        if self.weather == Weather::LowSun {
            return Vector3::from(LOW_SUN).normalize();
        }
        let noon = Vector3::from(NOON_SUN).normalize();
        let hours = self.hour - NOON_H;
        if hours == 0.0 {
            return noon;
        }
        let height = noon.z * (hours * std::f64::consts::FRAC_PI_2 / 6.5).cos();
        let (sin, cos) = (-hours * 15.0_f64.to_radians()).sin_cos();
        let along = Vector3::new(cos * noon.x - sin * noon.y, sin * noon.x + cos * noon.y, 0.0).normalize();
        let flat = (1.0 - height * height).max(0.0).sqrt();
        Vector3::new(flat * along.x, flat * along.y, height)
    }

    /// A picture of another width \[px\] with the same view.
    #[must_use]
    pub fn with_width(mut self, width: u32) -> Self {
        let factor = f64::from(width) / f64::from(self.camera.width);
        let c = self.camera;
        // Pixel centres lie at integers: the left edge is at -0.5.
        let scaled = |p: f64| (p + 0.5) * factor - 0.5;
        let height = (f64::from(c.height) * factor).round() as u32;
        self.camera = PinholeCamera {
            fx: c.fx * factor,
            fy: c.fy * factor,
            cx: scaled(c.cx),
            cy: scaled(c.cy),
            width,
            height,
        };
        self
    }

    /// The same picture size with another horizontal field of view \[rad\].
    #[must_use]
    pub fn with_view(mut self, view_rad: f64) -> Self {
        let focal = 0.5 * f64::from(self.camera.width) / (0.5 * view_rad).tan();
        (self.camera.fx, self.camera.fy) = (focal, focal);
        self
    }

    /// Checks the values.
    ///
    /// # Errors
    /// An invalid option, by name and reason.
    pub fn validate(&self) -> Result<()> {
        self.camera.validate().map_err(|e| Error::Plan(e.to_string()))?;
        let fine = self.fps.is_finite() && self.fps > 0.0 && self.fps <= 1000.0;
        if !fine {
            return Err(Error::Plan(format!("frames per second must lie in (0, 1000], got {}", self.fps)));
        }
        if !(6.0..=18.0).contains(&self.hour) {
            return Err(Error::Plan(format!("the hour must lie in [6, 18], got {}", self.hour)));
        }
        if self.sensor.blur_samples == 0 {
            return Err(Error::Plan("at least one blur sample is needed".into()));
        }
        let SensorOptions { noise, exposure_drift, shutter_s, readout_s, blur_samples } = self.sensor;
        if readout_s > 0.0 && blur_samples > 1 {
            return Err(Error::Plan("a rolling shutter has no motion blur here: one blur sample".into()));
        }
        let sensor = [
            ("noise [grey levels]", noise, 100.0),
            ("exposure drift [share]", exposure_drift, 0.6),
            ("shutter time [s]", shutter_s, 1.0 / self.fps),
            ("readout time [s]", readout_s, 1.0 / self.fps),
        ];
        for (what, value, most) in sensor {
            // NaN lies in no range.
            if !(0.0..=most).contains(&value) {
                return Err(Error::Plan(format!("{what} must lie in [0, {most}], got {value}")));
            }
        }
        Ok(())
    }
}

/// Errors of the simulated detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectorOptions {
    /// Standard deviation of a box edge \[px\].
    pub edge_sigma_px: f64,
    /// Probability of missing a clearly visible vehicle; occluded or small ones are missed more often.
    pub miss_chance: f64,
    /// Expected number of false boxes at random positions in a frame.
    pub false_boxes: f64,
    /// Expected number of false boxes on walls beside the road in a frame: the same structure is detected as a car for a second
    /// or more, so that the box moves as a static object does.
    pub wall_boxes: f64,
    /// Probability that a box jumps: its edges move by up to `jump_share` of its size for one frame.
    pub jump_chance: f64,
    /// Largest displacement of a jump, as a share of the box's size.
    pub jump_share: f64,
    /// Least height of detected vehicles \[px\].
    pub least_height_px: f64,
}

impl Default for DetectorOptions {
    fn default() -> Self {
        Self {
            edge_sigma_px: 1.2,
            miss_chance: 0.02,
            false_boxes: 0.03,
            wall_boxes: 0.0,
            jump_chance: 0.0,
            jump_share: 0.25,
            least_height_px: 14.0,
        }
    }
}
