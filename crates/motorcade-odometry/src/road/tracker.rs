//! The road plane from frame to frame: finds it, follows it, finds it again.

use std::collections::VecDeque;
use std::sync::Arc;

use motorcade_geometry::{BoundingBox, Camera, PinholeCamera, Pose, World, robust::median};
use nalgebra::{Point2, Vector3};

use super::alignment::{RoadOptions, RoadPlane, RoadScratch, RoadView, align_road, search_scale};
use super::measurement::RoadMeasurement;
use super::pixels::RoadPixels;
use crate::tracking::Pyramid;

/// What a frame offers for the road.
#[derive(Clone, Copy)]
pub struct RoadInput<'a> {
    /// The image.
    pub pyramid: &'a Arc<Pyramid>,
    /// Boxes of all vehicles, moving or not: they hide the road here, and later where this frame is the earlier one.
    pub vehicles: &'a [BoundingBox],
    /// Whether a road mask stands behind the pixels that may be road.
    pub masked: bool,
}

/// A frame that later ones are compared with.
struct Earlier {
    frame: usize,
    pyramid: Arc<Pyramid>,
    road: RoadPixels,
}

/// How far below its box a vehicle's shadow on the road reaches, of the height of the box.
const SHADOW: f64 = 0.15;
/// The rim of a box is half vehicle, half road \[px\].
const RIM_PX: f64 = 4.0;

/// A box with the road that the vehicle darkens: shadows go along with vehicles.
fn with_shadow(vehicle: &BoundingBox) -> BoundingBox {
    BoundingBox { y2: vehicle.y2 + SHADOW * (vehicle.y2 - vehicle.y1), ..*vehicle }.grown(RIM_PX)
}

/// Follows the road plane through a drive.
pub struct RoadTracker {
    camera: PinholeCamera,
    options: RoadOptions,
    ring: VecDeque<Earlier>,
    spare: RoadPixels,
    /// Present plane m in the odometry's unit, and the segment it belongs to.
    plane: Option<Vector3<f64>>,
    /// Logarithm of |m| over the last ten seconds: the odometry's unit is held, and a plane that creeps away from it is false.
    anchor: Option<f64>,
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
/// Change of it over many seconds that is none: the road inside the adjustment holds the odometry's unit to a few percent.
const FARTHEST_DRIFT: f64 = 0.3;
/// How fast the anchor follows \[per measurement\], and after how many frames of seeking in vain it is given up: ten seconds and
/// three.
const ANCHOR_RATE: f64 = 0.01;
const DISTRUST_ANCHOR: usize = 30;
/// Failed alignments in a row after which the plane is sought anew.
const GIVE_UP: usize = 8;

impl RoadTracker {
    /// Knows nothing yet.
    pub fn new(camera: PinholeCamera, options: RoadOptions) -> Self {
        Self {
            camera,
            options,
            ring: VecDeque::new(),
            spare: RoadPixels::default(),
            plane: None,
            anchor: None,
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
    /// segment, `usable` the pixels that may be road.
    pub fn process(
        &mut self,
        frame: usize,
        segment: usize,
        sight: &RoadInput<'_>,
        pose_of: impl Fn(usize) -> Option<Pose<Camera, World>>,
        usable: impl Fn(&Point2<f64>) -> bool,
    ) {
        let half_width_heights =
            if sight.masked { self.options.half_width_heights } else { self.unmasked_half_width };
        let options = RoadOptions { half_width_heights, ..self.options };
        if segment != self.segment {
            (self.segment, self.plane, self.anchor, self.failures) = (segment, None, None, 0);
            self.seek_anew();
            self.ring.clear();
        }
        let road = self.road_pixels(sight, usable);
        let usable = |p: &Point2<f64>| road.holds(p);
        if let Some(current) = pose_of(frame) {
            let measured = match self.plane {
                Some(plane) => {
                    self.follow(frame, sight.pyramid, plane, &current, &pose_of, &usable, &options)
                }
                None => self.seek(sight.pyramid, &current, &pose_of, &usable, &options),
            };
            self.measurements.extend(measured);
        }
        self.ring.push_back(Earlier { frame, pyramid: sight.pyramid.clone(), road });
        if self.ring.len() > self.options.oldest_frames {
            self.spare = self.ring.pop_front().map(|e| e.road).unwrap_or_default();
        }
    }

    /// Where this frame shows road, in the memory of a frame that nobody asks any more.
    fn road_pixels(&mut self, sight: &RoadInput<'_>, usable: impl Fn(&Point2<f64>) -> bool) -> RoadPixels {
        let mut road = std::mem::take(&mut self.spare);
        // Beyond twice the stretch nobody will ask; nor above the horizon.
        let reach = 2.0 * self.options.far_heights;
        let near = |p: &Point2<f64>| self.normal.dot(&self.camera.ray(p)) * reach > 1.0;
        let hidden = |p: &Point2<f64>| sight.vehicles.iter().any(|v| with_shadow(v).contains(p.x, p.y));
        road.fill(&self.camera, |p| near(p) && usable(p) && !hidden(p));
        road
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
        let (earlier, motion) = self.ring.iter().rev().find_map(|earlier| {
            let motion: Pose<Camera, Camera> = (pose_of(earlier.frame)? * current.inverse()).cast();
            (motion.translation().norm() >= least).then_some((earlier, motion))
        })?;
        let reference = earlier.frame;
        let view = RoadView {
            camera: &self.camera,
            current: pyramid,
            reference: &earlier.pyramid,
            road_in_reference: if self.options.both_pictures {
                &earlier.road
            } else {
                RoadPixels::everywhere()
            },
            reference_from_current: motion,
            guess: plane,
        };
        // Smooth asphalt has false minima, and they fit as well as the true one; but no camera rises by a seventh at once.
        let anchor = self.anchor;
        let near = |found: &RoadPlane| {
            (found.m.norm() / plane.norm()).ln().abs() < FARTHEST_JUMP && anchored(anchor, &found.m)
        };
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
        self.anchor = self.anchor.map(|a| a + ANCHOR_RATE * (found.m.norm().ln() - a));
        Some(RoadMeasurement::new(frame, reference, motion.translation().norm(), &found))
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
        let (earlier, motion) = self.ring.iter().rev().find_map(|earlier| {
            let motion: Pose<Camera, Camera> = (pose_of(earlier.frame)? * current.inverse()).cast();
            (motion.translation().norm() >= 0.3 * GUESS_UNITS).then_some((earlier, motion))
        })?;
        let view = RoadView {
            camera: &self.camera,
            current: pyramid,
            reference: &earlier.pyramid,
            road_in_reference: if self.options.both_pictures {
                &earlier.road
            } else {
                RoadPixels::everywhere()
            },
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
            let found = candidate(view, usable, &options, &mut self.scratch);
            let anchor = self.anchor.filter(|_| self.sought <= DISTRUST_ANCHOR);
            candidates.extend(found.filter(|m| anchored(anchor, m)));
            if let Some(plane) = agreed(candidates) {
                self.plane = Some(plane);
                self.normal = plane.normalize();
                self.anchor = anchor.or(Some(plane.norm().ln()));
                break;
            }
        }
        None
    }
}

/// Whether a plane is as far away as the segment has had it so far.
fn anchored(anchor: Option<f64>, m: &Vector3<f64>) -> bool {
    anchor.is_none_or(|a| (m.norm().ln() - a).abs() < FARTHEST_DRIFT)
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
