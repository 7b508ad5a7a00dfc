//! A stretch of the drive without daylight: lamps at even distances, an exposure that follows late.

use super::colour::{Colour, scaled};
use super::surface_pixel::SurfacePixel;
use crate::drive::Drive;

/// Ends of the stretch, as shares of the way.
const STRETCH: [f64; 2] = [0.25, 0.7];
/// Light inside without lamps, and what a lamp adds below it, of that outside.
const DARK: f64 = 0.07;
const LAMP: f64 = 0.09;
/// Distance from lamp to lamp \[m\].
const LAMPS_M: f64 = 12.0;
/// Length of the transition at an end \[m\].
const END_M: f64 = 3.0;
/// Distance ahead for which the camera exposes \[m\].
const AHEAD_M: f64 = 12.0;
/// Largest gain, and the time in which the exposure follows \[s\].
const MOST_GAIN: f64 = 6.0;
const FOLLOWS_S: f64 = 0.5;

/// The stretch.
pub(super) struct Tunnel {
    /// Ways from the start of the drive \[m\].
    from_m: f64,
    to_m: f64,
}

impl Tunnel {
    pub(super) fn of(drive: &Drive) -> Self {
        let whole = drive.ways_m().last().copied().unwrap_or(0.0);
        Self { from_m: STRETCH[0] * whole, to_m: STRETCH[1] * whole }
    }

    /// Share of daylight, 1 outside.
    fn daylight(&self, way_m: f64) -> f64 {
        let inside = ((way_m - self.from_m) / END_M).min((self.to_m - way_m) / END_M).clamp(0.0, 1.0);
        1.0 - inside
    }

    fn level(&self, way_m: f64) -> f64 {
        let daylight = self.daylight(way_m);
        let lamp = 0.5 + 0.5 * (std::f64::consts::TAU * way_m / LAMPS_M).cos();
        daylight + (1.0 - daylight) * (DARK + LAMP * lamp)
    }

    /// Colour of a pixel, in daylight `colour`, seen from one place of the way at another. Inside there is no sky.
    pub(super) fn seen(&self, colour: Colour, seen: &SurfacePixel, eye_m: f64, surface_m: f64) -> Colour {
        let level =
            if seen.depth_m.is_finite() { self.level(surface_m) } else { DARK.max(self.daylight(eye_m)) };
        scaled(colour, level as f32)
    }
}

/// Gain of the exposure in a frame: it follows the light ahead with a delay.
pub(super) fn gain(drive: &Drive, frame: usize) -> f64 {
    let tunnel = Tunnel::of(drive);
    let follows = 1.0 - (-1.0 / (drive.render.fps * FOLLOWS_S)).exp();
    let wanted = |way_m: &f64| (1.0 / tunnel.level(way_m + AHEAD_M)).clamp(1.0, MOST_GAIN);
    let mut ways = drive.ways_m().into_iter().take(frame + 1);
    let first = ways.next().map_or(1.0, |way_m| wanted(&way_m));
    ways.fold(first, |gain, way_m| gain + follows * (wanted(&way_m) - gain))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_dark_inside_and_day_outside() {
        let tunnel = Tunnel { from_m: 20.0, to_m: 80.0 };
        assert_eq!(tunnel.level(10.0), 1.0);
        assert_eq!(tunnel.level(90.0), 1.0);
        let (under, between) = (tunnel.level(48.0), tunnel.level(54.0));
        assert!((under - (DARK + LAMP)).abs() < 1e-9 && (between - DARK).abs() < 1e-9, "{under} {between}");
    }
}
