//! Asphalt patches and manholes of the carriageway, random for each section of road.

use crate::hash;
use crate::motion::Road;

/// Length of a section with at most one patch in each lane \[m\].
const PATCH_PITCH_M: f32 = 8.0;
/// Length of a section with one manhole \[m\].
const MANHOLE_PITCH_M: f32 = 21.0;

/// A rectangle of newer asphalt (s, d).
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    pub from_m: f32,
    pub to_m: f32,
    pub middle_m: f32,
    pub half_width_m: f32,
    /// Brightness relative to the old asphalt.
    pub tone: f32,
}

/// Patches and manholes of a road.
#[derive(Clone, Debug)]
pub(super) struct Repairs {
    first_patch: i64,
    patches: Vec<[Option<Patch>; 2]>,
    first_manhole: i64,
    manholes: Vec<[f32; 2]>,
}

impl Repairs {
    pub(super) fn of(road: &Road, seed: u64) -> Self {
        let half = road.half_width_m as f32;
        let (from, to) = road.extent_m();
        let cells = |pitch: f32| {
            let cell = |s: f64| (s / f64::from(pitch)).floor() as i64;
            cell(from) - 1..=cell(to) + 1
        };
        let patch = |cell: i64, lane: i64| {
            let uniform = |k: i64| hash::unit(seed ^ 0xa5fa, cell * 2 + lane.max(0), k);
            let from_m = cell as f32 * PATCH_PITCH_M + 0.3 + 2.5 * uniform(1);
            (uniform(0) < 0.7).then(|| Patch {
                from_m,
                to_m: from_m + 0.7 + 4.0 * uniform(2) * uniform(2),
                middle_m: lane as f32 * (0.5 + (half - 1.6) * uniform(3)),
                half_width_m: 0.35 + 0.7 * uniform(4),
                tone: 0.14 * uniform(5) - 0.11,
            })
        };
        let manhole = |cell: i64| {
            let uniform = |k: i64| hash::unit(seed ^ 0x3a9, cell, k);
            [cell as f32 * MANHOLE_PITCH_M + 3.0 + 15.0 * uniform(0), (uniform(1) - 0.5) * (half * 1.2)]
        };
        Self {
            first_patch: *cells(PATCH_PITCH_M).start(),
            patches: cells(PATCH_PITCH_M).map(|cell| [patch(cell, -1), patch(cell, 1)]).collect(),
            first_manhole: *cells(MANHOLE_PITCH_M).start(),
            manholes: cells(MANHOLE_PITCH_M).map(manhole).collect(),
        }
    }

    /// Patches of both lanes of the section at `s`; none reaches into the next.
    pub(super) fn patches_at(&self, s: f32) -> impl Iterator<Item = &Patch> {
        at(&self.patches, self.first_patch, s / PATCH_PITCH_M).into_iter().flatten().flatten()
    }

    /// (s, d) of the manhole of the section at `s`.
    pub(super) fn manhole_at(&self, s: f32) -> Option<[f32; 2]> {
        at(&self.manholes, self.first_manhole, s / MANHOLE_PITCH_M).copied()
    }
}

fn at<T>(cells: &[T], first: i64, cell: f32) -> Option<&T> {
    usize::try_from(super::tile::floor(cell) as i64 - first).ok().and_then(|i| cells.get(i))
}
