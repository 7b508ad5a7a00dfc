//! Candidates of an unknown plane, until enough of them agree.

use motorcade_geometry::robust::median;
use nalgebra::{Point2, Vector3};

use super::alignment::align_road;
use super::options::{PlaneSearchOptions, PlaneTrackingOptions, RoadOptions};
use super::search::search_scale;
use super::view::{RoadScratch, RoadView};
use crate::time::seconds;

/// State of the search.
#[derive(Default)]
pub(super) struct PlaneSearch {
    /// Planes found in the middle of the lane and in the whole lane.
    candidates: [Vec<Vector3<f64>>; 2],
    /// Time of the search so far \[ns\].
    searched_ns: i64,
}

impl PlaneSearch {
    /// Starts again.
    pub fn reset(&mut self) {
        self.candidates.iter_mut().for_each(Vec::clear);
        self.searched_ns = 0;
    }

    /// Adds the candidates of one frame, `elapsed_ns` after the frame before. Returns the plane once enough candidates agree,
    /// and the anchor if it is still required.
    pub fn add(
        &mut self,
        view: RoadView<'_>,
        usable: &impl Fn(&Point2<f64>) -> bool,
        options: &RoadOptions,
        anchor: Option<f64>,
        elapsed_ns: i64,
        scratch: &mut RoadScratch,
    ) -> Option<(Vector3<f64>, Option<f64>)> {
        let (search, tracking) = (&options.advanced.search, &options.advanced.tracking);
        // The middle of the lane first: a wet lane as a whole mirrors the sky. Where the middle is too smooth, the whole lane
        // is used, too.
        let middle = options.half_width_heights.min(tracking.unmasked_widest_heights);
        self.searched_ns += elapsed_ns;
        let searched_s = seconds(self.searched_ns);
        let widths = [middle, options.half_width_heights];
        let both = searched_s > search.middle_first_s && widths[1] > widths[0];
        let tried = if both { &widths[..] } else { &widths[..1] };
        let anchor = anchor.filter(|_| searched_s <= search.distrust_anchor_s);
        for (half_width_heights, candidates) in tried.iter().zip(&mut self.candidates) {
            let options = RoadOptions { half_width_heights: *half_width_heights, ..*options };
            let found = candidate(view, usable, &options, scratch);
            candidates.extend(found.filter(|m| near_anchor(anchor, m, tracking)));
            if let Some(plane) = agreed(candidates, search) {
                return Some((plane, anchor));
            }
        }
        None
    }
}

/// True when a plane is about as far away as the segment has had it so far; `anchor` is its log |m|.
pub(super) fn near_anchor(anchor: Option<f64>, m: &Vector3<f64>, options: &PlaneTrackingOptions) -> bool {
    anchor.is_none_or(|a| (m.norm().ln() - a).abs() < options.most_drift)
}

/// The plane of one frame when its distance is unknown.
fn candidate(
    mut view: RoadView<'_>,
    usable: &impl Fn(&Point2<f64>) -> bool,
    options: &RoadOptions,
    scratch: &mut RoadScratch,
) -> Option<Vector3<f64>> {
    view.guess = search_scale(&view, usable, options, scratch)?;
    let found = align_road(&view, usable, options, scratch)?;
    (found.m.angle(&Vector3::y()) < options.advanced.search.steepest_rad).then_some(found.m)
}

/// Mean of the candidates that agree, when they are enough and the majority.
fn agreed(candidates: &[Vector3<f64>], options: &PlaneSearchOptions) -> Option<Vector3<f64>> {
    let mut norms: Vec<f64> = candidates.iter().map(|m| m.norm()).collect();
    let centre = median(&mut norms)?;
    let near = |m: &&Vector3<f64>| (m.norm() / centre).ln().abs() < options.agreement;
    let agreeing: Vec<&Vector3<f64>> = candidates.iter().filter(near).collect();
    let enough = agreeing.len() >= options.agreeing && 2 * agreeing.len() > candidates.len();
    enough.then(|| agreeing.iter().copied().sum::<Vector3<f64>>() / agreeing.len() as f64)
}
