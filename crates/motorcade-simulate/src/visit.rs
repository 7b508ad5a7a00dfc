//! Another visit of the streets of a plan.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::hash;
use crate::plan::{Plan, Route};

/// Most that the camera starts farther on \[m\].
const LATER_START_M: f64 = 12.0;
/// Most that it drives to the side of where it drove before \[m\].
const ASIDE_M: f64 = 0.4;
/// Most that it is faster or slower, as a share.
const FASTER: f64 = 0.12;
/// Most that planned vehicles come sooner or later \[m\].
const SOONER_M: f64 = 40.0;

impl Plan {
    /// The plan of another visit, drawn from a seed.
    pub(crate) fn another_visit(&self, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(hash::mix(seed ^ 0x7151));
        let mut plan = self.clone();
        let (later_m, aside_m) = (rng.random_range(0.0..LATER_START_M), rng.random_range(-ASIDE_M..ASIDE_M));
        match &mut plan.ego_route {
            Route::Along { start_m, offsets_m } => {
                *start_m += later_m;
                offsets_m.iter_mut().for_each(|(_, d)| *d += aside_m);
            }
            Route::ThereAndBack { start_m, .. } | Route::Through { start_m, .. } => *start_m += later_m,
            Route::Oncoming { .. }
            | Route::Crossing { .. }
            | Route::TurnOff { .. }
            | Route::TurnIn { .. }
            | Route::Parked { .. }
            | Route::Standing { .. } => {}
        }
        plan.ego_speed = plan.ego_speed.times(1.0 + rng.random_range(-FASTER..FASTER));
        for driver in &mut plan.drivers {
            let shift_m = rng.random_range(-SOONER_M..SOONER_M);
            if let Route::Oncoming { start_m } = &mut driver.route {
                *start_m += shift_m;
            }
        }
        plan
    }
}
