//! Search of the distance of an unknown plane.

use nalgebra::{Point2, Vector3};

use super::options::RoadOptions;
use super::view::{RoadScratch, RoadView};

/// Searches the scale of the plane over a wide range around the guess, for the first frames of a segment, when the odometry's
/// unit is unknown. Returns the best m.
pub(super) fn search_scale(
    view: &RoadView<'_>,
    usable: impl Fn(&Point2<f64>) -> bool,
    options: &RoadOptions,
    scratch: &mut RoadScratch,
) -> Option<Vector3<f64>> {
    let search = &options.advanced.search;
    let level = search.level.min(view.current.len() - 1);
    let samples = &mut scratch.samples;
    view.samples(level, &usable, options, samples);
    if samples.len() < search.least_pixels {
        return None;
    }
    let plane = |k: i32| view.guess * search.range.powf(f64::from(k) / f64::from(search.steps));
    let scores: Vec<(f64, Vector3<f64>)> = (-search.steps..=2 * search.steps)
        .map(|k| (view.mismatch(&plane(k), samples, level, search).unwrap_or(f64::MAX), plane(k)))
        .collect();
    let best = (0..scores.len()).min_by(|a, b| scores[*a].0.total_cmp(&scores[*b].0))?;
    // A minimum at the end of the range is rejected: a wet road that mirrors the sky looks like a plane far below.
    (best > 0 && best + 1 < scores.len() && scores[best].0 < f64::MAX).then(|| scores[best].1)
}
