//! The drives of the suite and the bounds of their errors.

use motorcade_simulate::Weather::{self, Clear, Overcast, Rain};

/// Half of KITTI's: a quarter of the time. Vehicles count from 40 px on, so within 13 m.
const WIDTH_PX: u32 = 621;

/// Bounds of the errors.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// SE(3)-aligned \[m\].
    pub ego_ate_m: f64,
    /// Of the length of the way, either direction \[%\].
    pub scale_pct: f64,
    /// Mean over vehicles \[m\]; `None` where no vehicle counts (unhidden, 40 px high, within 50 m, 10 frames).
    pub vehicle_ate_m: Option<f64>,
    /// Least share of counting frames with an estimate \[%\].
    pub coverage_pct: Option<f64>,
    /// Least share of camera poses whose NEES lies below 12.6 \[%\]; 95 when covariances are right.
    pub nees_pct: f64,
}

/// One drive.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub name: &'static str,
    pub frames: usize,
    pub weather: Weather,
    /// Of the pictures \[px\].
    pub width_px: u32,
    pub bounds: Bounds,
}

impl Case {
    /// At KITTI's width, where vehicles count up to 27 m away: for drives with none nearer.
    const fn wide(self) -> Self {
        Self { width_px: 1242, ..self }
    }
}

/// Name, frames, weather; bounds: ego ATE \[m\], scale \[%\], vehicle ATE \[m\] and coverage \[%\], 0 for no vehicles,
/// NEES \[%\].
const fn case(name: &'static str, frames: usize, weather: Weather, bounds: [f64; 5]) -> Case {
    let [ego_ate_m, scale_pct, vehicle_ate_m, coverage_pct, nees_pct] = bounds;
    let seen = coverage_pct > 0.0;
    let bounds = Bounds {
        ego_ate_m,
        scale_pct,
        vehicle_ate_m: if seen { Some(vehicle_ate_m) } else { None },
        coverage_pct: if seen { Some(coverage_pct) } else { None },
        nees_pct,
    };
    Case { name, frames, weather, width_px: WIDTH_PX, bounds }
}

/// Run with every test run.
///
/// In the rain a single vehicle counts, 30 to 45 m away and placed with an error of the scale: over eight seeds its ATE is 0.4 to
/// 1.5 m (mean 1.1), though the 74 tracks that no bound sees are within 2.8 % of depth on average.
pub const SHORT: &[Case] = &[
    case("straight", 40, Clear, [0.3, 2.5, 0.0, 0.0, 60.0]),
    case("pitched", 40, Overcast, [0.15, 1.5, 0.0, 0.0, 60.0]),
    case("parked", 40, Rain, [0.35, 2.5, 1.6, 88.0, 60.0]),
    case("roundabout", 40, Clear, [0.3, 2.5, 0.8, 88.0, 60.0]),
];

/// Every scenario.
#[rustfmt::skip] // one drive a line
pub const FULL: &[Case] = &[
    case("demo", 110, Clear, [0.40, 1.7, 1.5, 88.0, 90.0]),
    case("straight", 60, Clear, [0.10, 0.8, 0.8, 88.0, 90.0]).wide(),
    case("bends", 60, Overcast, [0.10, 0.8, 0.8, 88.0, 90.0]).wide(),
    case("slope", 110, Clear, [0.80, 2.7, 2.6, 88.0, 90.0]),
    case("stop-and-go", 150, Clear, [0.15, 1.1, 1.2, 88.0, 90.0]),
    case("standing-start", 100, Clear, [0.10, 0.8, 0.8, 88.0, 90.0]),
    case("roundabout", 120, Clear, [0.25, 1.4, 0.8, 88.0, 90.0]),
    case("oncoming", 60, Overcast, [0.10, 0.8, 1.0, 88.0, 90.0]).wide(),
    case("oncoming", 60, Rain, [0.10, 0.8, 1.5, 88.0, 90.0]).wide(),
    case("crossing", 100, Clear, [0.20, 1.4, 0.8, 88.0, 90.0]),
    case("overtaking", 100, Overcast, [0.35, 1.6, 0.8, 88.0, 90.0]),
    case("turning", 100, Clear, [0.20, 1.3, 0.8, 88.0, 90.0]),
    case("parked", 90, Rain, [0.55, 2.5, 1.0, 88.0, 90.0]),
    case("rough", 60, Clear, [0.10, 0.8, 0.8, 88.0, 90.0]).wide(),
    case("truck", 90, Clear, [0.30, 1.6, 1.2, 88.0, 90.0]),
    case("dense", 90, Clear, [0.40, 1.9, 1.2, 88.0, 90.0]),
    case("empty", 100, Clear, [0.15, 0.8, 0.0, 0.0, 90.0]),
    case("crowd", 60, Clear, [0.15, 0.9, 1.3, 88.0, 80.0]),
    case("pitched", 60, Clear, [0.10, 0.8, 0.8, 88.0, 90.0]).wide(),
    case("rolled", 90, Clear, [0.30, 1.4, 0.9, 88.0, 90.0]),
    case("low-camera", 60, Clear, [0.10, 0.8, 0.8, 88.0, 90.0]).wide(),
    case("high-camera", 90, Clear, [0.15, 0.8, 1.3, 88.0, 90.0]),
    case("false-boxes", 90, Overcast, [0.20, 0.9, 1.2, 88.0, 90.0]),
    case("glimpses", 90, Clear, [0.60, 2.5, 0.0, 0.0, 90.0]),
    case("lorries", 90, Clear, [0.30, 1.4, 1.6, 88.0, 90.0]),
    case("jumping-boxes", 90, Clear, [0.30, 1.3, 1.5, 88.0, 90.0]),
    case("parked-across", 40, Clear, [0.10, 1.0, 0.8, 88.0, 90.0]),
    case("yard", 110, Clear, [0.10, 0.8, 0.8, 88.0, 90.0]),
    case("double-parked", 70, Overcast, [0.10, 0.8, 1.3, 88.0, 90.0]),
    case("roundabout-exits", 80, Clear, [0.10, 1.0, 0.8, 88.0, 90.0]),
    case("junction-turn", 70, Overcast, [0.10, 1.0, 1.1, 88.0, 90.0]),
    case("trailers", 50, Clear, [0.10, 0.8, 0.8, 88.0, 90.0]).wide(),
    case("motorway", 40, Clear, [0.50, 1.2, 1.4, 88.0, 50.0]),
    case("crest", 50, Clear, [0.95, 5.5, 4.3, 88.0, 80.0]).wide(),
];
