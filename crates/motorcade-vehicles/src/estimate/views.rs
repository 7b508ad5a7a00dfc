//! Measured positions of a track: boxes with one common size, fused with external views.

use motorcade_shape::SizePrior;
use nalgebra::{Matrix3, Point3};

use super::input::TrackInput;
use crate::box_fit::SingleView;
use crate::external::ExternalView;
use crate::ground::GroundFrame;
use crate::joint_size::{JointSize, SizeByRoad};
use crate::motion::PositionMeasurement;
use crate::track::TrackBox;

/// Position in one frame, all sources fused.
#[derive(Clone, Copy)]
pub(super) struct View {
    pub(super) frame: usize,
    pub(super) position_in_camera: Point3<f64>,
    /// 3×3, camera frame \[m²\].
    pub(super) covariance: Matrix3<f64>,
}

/// Views of a track for one set of headings.
pub(super) struct Views {
    /// In order of frames.
    pub(super) views: Vec<View>,
    /// Fits of the boxes with the common size, in order of frames.
    pub(super) boxes: Vec<(usize, SingleView)>,
    pub(super) size: JointSize,
    pub(super) size_by_road: Option<SizeByRoad>,
    /// χ² of the boxes and the size.
    pub(super) chi2: f64,
    /// Twice the negative logarithm of the likelihood of boxes, road and size, up to a constant.
    pub(super) cost: f64,
    /// Square root of the reduced χ², at least 1: factor on the standard deviations.
    pub(super) inflation: f64,
}

impl Views {
    /// Fits every box with the given headings, estimates the common size, and fits them again with it. `earlier` fits, with other headings, are where
    /// to start.
    pub(super) fn new(
        input: &TrackInput<'_>,
        headings: &[f64],
        earlier: &[(usize, SingleView)],
    ) -> Option<Self> {
        let sizes = &input.options.advanced.size;
        let fit_all = |prior: &SizePrior, earlier: &[(usize, SingleView)]| {
            input.fit_boxes(headings, &prior.mean, &prior.information(), earlier)
        };
        let first = fit_all(&input.prior, earlier);
        let independent = input.independent_views(first.len(), span(&first), sizes.independent_views);
        let size = JointSize::from_views(&first, &input.prior, independent, sizes)?;
        let size_by_road = SizeByRoad::from_views(
            &first,
            input.track.votes.class(),
            input.independent_views(first.len(), span(&first), f64::MAX),
            independent,
            &input.options.advanced.box_fit,
        );
        let boxes = if sizes.shared { fit_all(&size.as_prior(sizes), &first) } else { first };
        let class = sizes.prior(input.track.class);
        let height_m = boxes.first().map_or(1.0, |(frame, _)| input.grounds[*frame].height_m);
        let size = size.with_level(&boxes, &class, height_m, &input.options.advanced.box_fit);
        let GoodnessOfFit { chi2, cost, inflation } = GoodnessOfFit::new(input, &boxes, &size);
        let views = fuse(&boxes, &input.external.views);
        (!views.is_empty()).then_some(Self { views, boxes, size, size_by_road, chi2, cost, inflation })
    }

    /// The view of a frame.
    pub(super) fn in_frame(&self, frame: usize) -> Option<&View> {
        self.views.binary_search_by_key(&frame, |v| v.frame).ok().and_then(|k| self.views.get(k))
    }

    /// Positions in the world.
    pub(super) fn positions(&self, grounds: &[GroundFrame]) -> Vec<PositionMeasurement> {
        let one = |view: &View| {
            let ground = &grounds[view.frame];
            let r = ground.world_from_camera.rotation_matrix();
            PositionMeasurement {
                frame: view.frame,
                time_s: ground.time_s,
                position: ground.world_from_camera.transform_point(&view.position_in_camera).coords,
                covariance: r * view.covariance * r.transpose(),
                range_m: view.position_in_camera.coords.norm(),
                toward: r * view.position_in_camera.coords.normalize(),
            }
        };
        self.views.iter().map(one).collect()
    }
}

/// First and last frame of fitted boxes.
fn span(boxes: &[(usize, SingleView)]) -> (usize, usize) {
    let frame = |b: Option<&(usize, SingleView)>| b.map_or(0, |(frame, _)| *frame);
    (frame(boxes.first()), frame(boxes.last()))
}

/// How well the boxes of a track fit, counted as a limited number of independent ones.
struct GoodnessOfFit {
    /// χ² of the edges and of the size against its prior.
    chi2: f64,
    /// As [`Views::cost`].
    cost: f64,
    /// Square root of the reduced χ², at least 1.
    inflation: f64,
}

impl GoodnessOfFit {
    fn new(input: &TrackInput<'_>, boxes: &[(usize, SingleView)], size: &JointSize) -> Self {
        let advanced = &input.options.advanced;
        let (hypothesis, saturation) = (&advanced.hypothesis, advanced.box_fit.saturation_chi2);
        let count = input.track.boxes.iter().filter(|b| b.observed.is_sufficient()).count().max(boxes.len());
        // A box without a fit counts as the worst one.
        let unexplained = (count - boxes.len()) as f64 * saturation;
        let edges = boxes.iter().map(|(_, view)| view.chi2.min(saturation)).sum::<f64>() + unexplained;
        let costs = boxes.iter().map(|(_, view)| view.cost).sum::<f64>() + unexplained;
        let difference = size.size.to_vector() - input.prior.mean.to_vector();
        let of_size = difference.component_div(&input.prior.sigma.to_vector()).norm_squared();
        let boxes_of_track = &input.track.boxes;
        let frame = |b: Option<&TrackBox>| b.map_or(0, |b| b.frame);
        let span = (frame(boxes_of_track.first()), frame(boxes_of_track.last()));
        let independent = input.independent_views(count.max(1), span, hypothesis.independent_views);
        let of_all = |sum: f64| sum * independent / count.max(1) as f64 + of_size;
        let chi2 = of_all(edges);
        let inflation = (chi2 / (hypothesis.expected_chi2 * independent)).max(1.0).sqrt();
        Self { chi2, cost: of_all(costs), inflation }
    }
}

/// One view per frame: boxes and external views, weighted by their information.
fn fuse(boxes: &[(usize, SingleView)], external: &[ExternalView]) -> Vec<View> {
    let of_box = |(frame, v): &(usize, SingleView)| View {
        frame: *frame,
        position_in_camera: v.position_in_camera,
        covariance: v.covariance,
    };
    let of_external = |v: &ExternalView| View {
        frame: v.frame,
        position_in_camera: v.position_in_camera,
        covariance: v.covariance,
    };
    let mut all: Vec<View> = boxes.iter().map(of_box).chain(external.iter().map(of_external)).collect();
    // Stable: of one frame the boxes stay before the external views.
    all.sort_by_key(|v| v.frame);
    let mut fused: Vec<View> = Vec::with_capacity(all.len());
    for view in all {
        match fused.last_mut().filter(|last| last.frame == view.frame) {
            Some(last) => *last = mean(last, &view).unwrap_or(*last),
            None => fused.push(view),
        }
    }
    fused
}

/// Information-weighted mean of two views of a frame; `None` when a covariance is singular.
fn mean(a: &View, b: &View) -> Option<View> {
    let (of_a, of_b) = (a.covariance.try_inverse()?, b.covariance.try_inverse()?);
    let covariance = (of_a + of_b).try_inverse()?;
    let sum = of_a * a.position_in_camera.coords + of_b * b.position_in_camera.coords;
    Some(View { frame: a.frame, position_in_camera: Point3::from(covariance * sum), covariance })
}
