//! Light and haze of a weather.

use super::colour::Colour;
use crate::options::RenderOptions;
use crate::weather::Weather;

/// Light and haze, the same for all surfaces of a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Air {
    /// Colour of the far distance.
    pub haze: Colour,
    /// Distance at which haze replaces 63 % of a surface's colour \[m\].
    pub reach_m: f32,
    /// 0 for a clear sky with sharp shadows, 1 for a grey one without.
    pub overcast: f32,
    /// Brightness relative to a clear day.
    pub brightness: f32,
    /// 0 for a dry road, 1 for a wet one.
    pub wet: f32,
    /// Colour of clouds.
    pub cloud: Colour,
}

impl Air {
    pub(super) fn of(options: &RenderOptions) -> Self {
        let fine = Self {
            haze: [0.74, 0.78, 0.82],
            reach_m: 420.0,
            overcast: options.weather.overcast(),
            brightness: 1.0,
            wet: 0.0,
            cloud: [0.93, 0.94, 0.95],
        };
        let rain = Self {
            haze: [0.55, 0.57, 0.59],
            reach_m: 190.0,
            brightness: 0.68,
            wet: 1.0,
            cloud: [0.62, 0.64, 0.66],
            ..fine
        };
        if options.weather == Weather::Rain { rain } else { fine }
    }
}
