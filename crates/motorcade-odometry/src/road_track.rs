//! The road plane from frame to frame: finds it, follows it, finds it again.

use std::collections::VecDeque;
use std::sync::Arc;

use motorcade_geometry::{Camera, PinholeCamera, Pose, World, robust::median};
use nalgebra::{Matrix3, Point2, Vector3};

use crate::pyramid::Pyramid;
use crate::record::UpToScale;
use crate::road::{RoadOptions, RoadPlane, RoadScratch, RoadView, align_road, search_scale};

/// What one frame says about road and scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadMeasurement {
    /// Frame (row of the run).
    pub frame: usize,
    /// Earlier frame it was compared with.
    pub reference: usize,
    /// `[log(|m|·height unit), pitch, roll]`: log of 1 / camera height in the odometry's unit, pitch and roll of the road
    /// relative to the camera \[rad\].
    pub value: Vector3<f64>,
    /// Distance between the two cameras in the odometry's unit, as the poses stood then.
    pub baseline: f64,
    /// Covariance of the value (3×3) as the pixels tell it.
    pub covariance: Matrix3<f64>,
    /// Share of the road pixels that agree.
    pub agreement: f64,
    /// Pixels used.
    pub pixels: usize,
}

impl RoadMeasurement {
    /// The value by the poses as they stand now. The images told the baseline in camera heights; a later adjustment that
    /// stretches the baseline stretches the height with it.
    pub fn value_by(&self, odometry: &UpToScale) -> Vector3<f64> {
        let pose = |k: usize| odometry.camera_from_world(k);
        let now = pose(self.reference).zip(pose(self.frame));
        let now = now.map(|(a, b)| (a * b.inverse()).translation().norm()).filter(|l| *l > 1e-9);
        let stretched = now.map_or(0.0, |length| (self.baseline / length).ln());
        self.value + Vector3::new(stretched, 0.0, 0.0)
    }
}

/// Unit normal of the road towards the camera, in the camera frame, from pitch and roll.
///
/// Pitch turns the far road up (a camera looking down has positive pitch), roll tips it sideways:
/// `n ∝ −(tan roll, 1, tan pitch)`.
pub fn road_normal(pitch_rad: f64, roll_rad: f64) -> Vector3<f64> {
    -Vector3::new(roll_rad.tan(), 1.0, pitch_rad.tan()).normalize()
}

/// `[log|m|, pitch, roll]` of a plane and the derivative by m (3×3).
fn coordinates(m: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let norm2 = m.norm_squared();
    let value = Vector3::new(0.5 * norm2.ln(), (m.z / m.y).atan(), (m.x / m.y).atan());
    let (yz, yx) = (m.y * m.y + m.z * m.z, m.y * m.y + m.x * m.x);
    let jacobian = Matrix3::new(
        m.x / norm2,
        m.y / norm2,
        m.z / norm2,
        0.0,
        -m.z / yz,
        m.y / yz,
        m.y / yx,
        -m.x / yx,
        0.0,
    );
    (value, jacobian)
}

/// Follows the road plane through a drive.
pub struct RoadTracker {
    camera: PinholeCamera,
    options: RoadOptions,
    ring: VecDeque<(usize, Arc<Pyramid>)>,
    /// Present plane m in the odometry's unit, and the segment it belongs to.
    plane: Option<Vector3<f64>>,
    /// Normal of the last known plane: a new segment has another unit but the same camera.
    normal: Vector3<f64>,
    /// Planes found while none is believed: in the middle of the lane, in the whole of it.
    candidates: [Vec<Vector3<f64>>; 2],
    /// Frames since none is believed.
    sought: usize,
    segment: usize,
    failures: usize,
    /// Half width of the stretch without a road mask \[camera heights\].
    unmasked_half_width: f64,
    measurements: Vec<RoadMeasurement>,
    scratch: RoadScratch,
}

/// Frames that must agree on a plane before it is believed.
const AGREEING: usize = 3;
/// Frames in which only the middle of the lane is looked at for a new plane: a second.
const MIDDLE_FIRST: usize = 10;
/// A camera looks along the road within 11°, or what was found is no road \[rad\].
const STEEPEST_RAD: f64 = 0.2;
/// Change of the logarithm of the camera's height from one measurement to the next that is no measurement any more. Good ones
/// scatter by 0.03.
const FARTHEST_JUMP: f64 = 0.15;
/// Failed alignments in a row after which the plane is sought anew.
const GIVE_UP: usize = 8;

impl RoadTracker {
    /// Knows nothing yet.
    pub fn new(camera: PinholeCamera, options: RoadOptions) -> Self {
        Self {
            camera,
            options,
            ring: VecDeque::new(),
            plane: None,
            normal: Vector3::y(),
            candidates: [Vec::new(), Vec::new()],
            sought: 0,
            segment: 0,
            failures: 0,
            unmasked_half_width: options.unmasked_half_width_heights,
            measurements: Vec::new(),
            scratch: RoadScratch::default(),
        }
    }

    /// All measurements so far.
    pub fn measurements(&self) -> &[RoadMeasurement] {
        &self.measurements
    }

    /// The plane as last followed, in the odometry's unit; m with `mᵀX = 1`.
    pub fn plane(&self) -> Option<Vector3<f64>> {
        self.plane
    }

    /// Looks at frame `frame` of segment `segment`; `pose_of` gives `camera_from_world` of it and of earlier frames of the
    /// segment, `usable` the pixels that may be road, `masked` whether a road mask stands behind it.
    pub fn process(
        &mut self,
        frame: usize,
        segment: usize,
        pyramid: &Arc<Pyramid>,
        pose_of: impl Fn(usize) -> Option<Pose<Camera, World>>,
        masked: bool,
        usable: impl Fn(&Point2<f64>) -> bool,
    ) {
        let half_width_heights =
            if masked { self.options.half_width_heights } else { self.unmasked_half_width };
        let options = RoadOptions { half_width_heights, ..self.options };
        if segment != self.segment {
            (self.segment, self.plane, self.failures) = (segment, None, 0);
            self.seek_anew();
            self.ring.clear();
        }
        if let Some(current) = pose_of(frame) {
            let measured = match self.plane {
                Some(plane) => self.follow(frame, pyramid, plane, &current, &pose_of, &usable, &options),
                None => self.seek(pyramid, &current, &pose_of, &usable, &options),
            };
            self.measurements.extend(measured);
        }
        self.ring.push_back((frame, pyramid.clone()));
        if self.ring.len() > self.options.oldest_frames {
            self.ring.pop_front();
        }
    }

    #[expect(clippy::too_many_arguments, reason = "the parts of one measurement")]
    fn follow(
        &mut self,
        frame: usize,
        pyramid: &Arc<Pyramid>,
        plane: Vector3<f64>,
        current: &Pose<Camera, World>,
        pose_of: &impl Fn(usize) -> Option<Pose<Camera, World>>,
        usable: &impl Fn(&Point2<f64>) -> bool,
        options: &RoadOptions,
    ) -> Option<RoadMeasurement> {
        // Below this no image motion tells the plane: standing, or a single step of walking pace.
        let least = self.options.baseline_heights / plane.norm();
        let (reference, image, motion) = self.ring.iter().rev().find_map(|(k, image)| {
            let motion: Pose<Camera, Camera> = (pose_of(*k)? * current.inverse()).cast();
            (motion.translation().norm() >= least).then_some((*k, image, motion))
        })?;
        let view = RoadView {
            camera: &self.camera,
            current: pyramid,
            reference: image,
            reference_from_current: motion,
            guess: plane,
        };
        // Smooth asphalt has false minima, and they fit as well as the true one; but no camera rises by a seventh at once.
        let near = |found: &RoadPlane| (found.m.norm() / plane.norm()).ln().abs() < FARTHEST_JUMP;
        let found = align_road(&view, usable, options, &mut self.scratch).filter(near);
        self.adapt_width(found.as_ref());
        let Some(found) = found else {
            self.failures += 1;
            if self.failures >= GIVE_UP {
                (self.plane, self.failures) = (None, 0);
                self.seek_anew();
            }
            return None;
        };
        self.failures = 0;
        // The guess follows slowly: one frame's noise must not carry the next one's start away.
        const FOLLOW: f64 = 0.3;
        let updated = plane + (found.m - plane) * FOLLOW;
        self.plane = Some(updated);
        self.normal = updated.normalize();
        Some(measurement(frame, reference, motion.translation().norm(), &found))
    }

    /// Looks at a wider stretch where the present one does not align or has too little texture, at a narrower one where it has
    /// plenty.
    fn adapt_width(&mut self, found: Option<&RoadPlane>) {
        const STEP: f64 = 1.1;
        let wanted = self.options.unmasked_pixels;
        let factor = match found.map_or(0, |f| f.pixels) {
            n if n < wanted => STEP,
            n if n > 2 * wanted => 1.0 / STEP,
            _ => 1.0,
        };
        let narrow = self.options.unmasked_half_width_heights;
        let wide = self.options.unmasked_widest_heights.max(narrow);
        self.unmasked_half_width = (self.unmasked_half_width * factor).clamp(narrow, wide);
    }

    fn seek_anew(&mut self) {
        self.candidates.iter_mut().for_each(Vec::clear);
        self.sought = 0;
    }

    /// Searches the plane's distance over a wide range until a few frames agree.
    fn seek(
        &mut self,
        pyramid: &Arc<Pyramid>,
        current: &Pose<Camera, World>,
        pose_of: &impl Fn(usize) -> Option<Pose<Camera, World>>,
        usable: &impl Fn(&Point2<f64>) -> bool,
        options: &RoadOptions,
    ) -> Option<RoadMeasurement> {
        // The odometry's unit makes a street's median depth 15: a car's camera is then 1 to 4 units high.
        const GUESS_UNITS: f64 = 2.0;
        let guess = self.normal / GUESS_UNITS;
        let (image, motion) = self.ring.iter().rev().find_map(|(k, image)| {
            let motion: Pose<Camera, Camera> = (pose_of(*k)? * current.inverse()).cast();
            (motion.translation().norm() >= 0.3 * GUESS_UNITS).then_some((image, motion))
        })?;
        let view = RoadView {
            camera: &self.camera,
            current: pyramid,
            reference: image,
            reference_from_current: motion,
            guess,
        };
        // The middle of the lane first: where it is wet, the lane as a whole mirrors more of the sky than it shows of itself.
        // Where the middle is too smooth to tell, the whole lane may.
        let middle = options.half_width_heights.min(self.options.unmasked_widest_heights);
        self.sought += 1;
        let widths = [middle, options.half_width_heights];
        let both = self.sought > MIDDLE_FIRST && widths[1] > widths[0];
        let tried = if both { &widths[..] } else { &widths[..1] };
        for (half_width_heights, candidates) in tried.iter().zip(&mut self.candidates) {
            let options = RoadOptions { half_width_heights: *half_width_heights, ..*options };
            candidates.extend(candidate(view, usable, &options, &mut self.scratch));
            if let Some(plane) = agreed(candidates) {
                self.plane = Some(plane);
                self.normal = plane.normalize();
                break;
            }
        }
        None
    }
}

/// The plane that one frame finds when nothing is known of its distance.
fn candidate(
    mut view: RoadView<'_>,
    usable: &impl Fn(&Point2<f64>) -> bool,
    options: &RoadOptions,
    scratch: &mut RoadScratch,
) -> Option<Vector3<f64>> {
    view.guess = search_scale(&view, usable, options, scratch)?;
    let found = align_road(&view, usable, options, scratch)?;
    (found.m.angle(&Vector3::y()) < STEEPEST_RAD).then_some(found.m)
}

/// The mean of the candidates that agree, when they are enough, and more than half of all.
fn agreed(candidates: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let mut norms: Vec<f64> = candidates.iter().map(|m| m.norm()).collect();
    let centre = median(&mut norms)?;
    let near = |m: &&Vector3<f64>| (m.norm() / centre).ln().abs() < 0.1;
    let agreeing: Vec<&Vector3<f64>> = candidates.iter().filter(near).collect();
    let enough = agreeing.len() >= AGREEING && 2 * agreeing.len() > candidates.len();
    enough.then(|| agreeing.iter().copied().sum::<Vector3<f64>>() / agreeing.len() as f64)
}

fn measurement(frame: usize, reference: usize, baseline: f64, plane: &RoadPlane) -> RoadMeasurement {
    let (value, jacobian) = coordinates(&plane.m);
    let covariance = jacobian * plane.covariance * jacobian.transpose();
    RoadMeasurement {
        frame,
        reference,
        value,
        baseline,
        covariance,
        agreement: plane.agreement,
        pixels: plane.pixels,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_match_their_derivative_and_the_normal() {
        let m = Vector3::new(0.01, 0.55, 0.02);
        let (value, jacobian) = coordinates(&m);
        for k in 0..3 {
            let mut moved = m;
            moved[k] += 1e-7;
            assert!(((coordinates(&moved).0 - value) / 1e-7 - jacobian.column(k)).norm() < 1e-5);
        }
        assert!((road_normal(value.y, value.z) + m.normalize()).norm() < 1e-12);
    }
}
