//! Views of a track from its keypoints by the shape prior (the paper's equations 6 to 8), all with the one shape they agree on.

use motorcade_geometry::{Camera, PinholeCamera, Pose, RoadPlane, Vehicle};
use motorcade_perception::{BoundingBox, VehicleClass, VehicleKeypoints};
use motorcade_shape::{
    CLEAR_COST, Dimensions, HeadingEvidence, Layout, MeasuredRoad, Observation, ShapeFit, ShapeFitter,
    ShapePrior, SizePrior, TrackFit, TrackShape,
};
use nalgebra::{Matrix3, Point3, Vector3};

use super::frame_keypoints::FrameKeypoints;
use super::heading_vote::{Vote, vote};
use super::keypoint_track::KeypointTrack;
use super::{ExternalTrack, ExternalView, SizeDependence};
use crate::ground::GroundFrame;
use crate::options::{AdvancedVehicleOptions, BoxFitOptions, KeypointViewOptions, SizeOptions};
use crate::size_prior::size_prior;
use crate::track::{Track, TrackBox};
use crate::trajectory::Source;

/// Layouts that are fitted; indices of `fitters` and of [`FrameKeypoints::layout`].
const LAYOUTS: [Layout; 2] = [Layout::Car36, Layout::Car14];

/// Fitters of the shape prior, one a layout of keypoints.
pub struct KeypointFitters([ShapeFitter; 2]);

impl KeypointFitters {
    /// `shape_prior` replaces the built-in one of its number of keypoints.
    pub fn new(shape_prior: Option<&ShapePrior>, options: &AdvancedVehicleOptions) -> Self {
        Self(LAYOUTS.map(|layout| {
            let matching = shape_prior.filter(|p| p.keypoints().len() == layout.count()).cloned();
            let prior = matching.unwrap_or_else(|| ShapePrior::of_family(layout));
            ShapeFitter::new(prior, options.keypoints.fit)
        }))
    }
}

/// Fits the shape prior to the keypoints of tracks.
pub struct KeypointViews<'a> {
    keypoints: &'a [&'a [VehicleKeypoints]],
    camera: &'a PinholeCamera,
    grounds: &'a [GroundFrame],
    options: &'a KeypointViewOptions,
    box_fit: &'a BoxFitOptions,
    sizes: &'a SizeOptions,
    fitters: &'a [ShapeFitter; 2],
}

impl<'a> KeypointViews<'a> {
    /// `keypoints` and `grounds` are those of each frame.
    pub fn new(
        keypoints: &'a [&'a [VehicleKeypoints]],
        fitters: &'a KeypointFitters,
        camera: &'a PinholeCamera,
        grounds: &'a [GroundFrame],
        options: &'a AdvancedVehicleOptions,
    ) -> Self {
        let (options, box_fit, sizes) = (&options.keypoints, &options.box_fit, &options.size);
        Self { keypoints, camera, grounds, options, box_fit, sizes, fitters: &fitters.0 }
    }

    /// A view for each frame of a track that has keypoints; none for classes outside the shape prior.
    pub fn of_track(&self, track: &Track) -> ExternalTrack {
        self.of_known(track, &mut KeypointTrack::new(track.class), &|frame| frame)
    }

    /// The same for a track of which frames were fitted before, in a window that has moved on: those are not fitted again. `row` is the
    /// number of a frame that stays when the window moves.
    pub fn of_known(
        &self,
        track: &Track,
        known: &mut KeypointTrack,
        row: &dyn Fn(usize) -> usize,
    ) -> ExternalTrack {
        if !self.options.enabled || !matches!(track.class, VehicleClass::Car | VehicleClass::Van) {
            return ExternalTrack::default();
        }
        if known.class != track.class {
            *known = KeypointTrack::new(track.class);
        }
        known.most_earlier = self.options.most_earlier_frames;
        for b in &track.boxes {
            let found = || self.in_frame(b, track.class);
            known.add(row(b.frame), found);
        }
        if known.is_due(self.options.shape_frames) {
            let shapes = [0, 1].map(|layout| self.common_shape(&known.of_layout(layout), layout));
            known.set_shapes(shapes, self.options.shape_frames);
        }
        let shapes = known.shapes();
        known.fit_missing(|frame| self.fit(frame, &frame.observation, &shapes));
        let rows: Vec<(usize, usize)> = track.boxes.iter().map(|b| (b.frame, row(b.frame))).collect();
        let fitted: Vec<(usize, usize)> =
            rows.into_iter().filter(|(_, row)| known.fit(*row).is_some()).collect();
        let votes = fitted.iter().filter_map(|(_, row)| known.fit(*row)).map(heading_vote);
        let verdict = vote(&votes.collect::<Vec<_>>(), self.options);
        let settled = verdict.margin >= CLEAR_COST;
        let mut views = Vec::with_capacity(fitted.len());
        for ((frame, row), turned) in fitted.into_iter().zip(verdict.turned) {
            let fit = if settled && turned {
                known.turn(row, |keypoints, fit| self.turned(keypoints, fit, &shapes));
                known.turned(row)
            } else {
                known.fit(row).filter(|fit| settled || !fit.heading_is_ambiguous())
            };
            let dimensions = known.size().map(|fit| fit.dimensions);
            views.extend(fit.map(|fit| view(frame, fit, dimensions, self.options)));
        }
        let size = known.size().map(|fit| size(fit, &self.sizes.prior(track.class), self.options));
        ExternalTrack { views, size }
    }

    /// Mean log odds that the boxes of a track show a vehicle at all; `None` where it is not known.
    pub fn presence(&self, track: &Track) -> Option<f64> {
        let found = |b: &TrackBox| self.in_box(b.frame, &b.observed.bbox, |k| k.presence.is_some())?.presence;
        let (count, sum) =
            track.boxes.iter().filter_map(found).fold((0_u32, 0.0), |(n, sum), odds| (n + 1, sum + odds));
        (count > 0).then(|| sum / f64::from(count))
    }

    fn fit(
        &self,
        frame: &FrameKeypoints,
        observation: &Observation,
        shapes: &[Option<TrackShape>; 2],
    ) -> Option<ShapeFit> {
        let fitter = &self.fitters[frame.layout];
        match &shapes[frame.layout] {
            Some(shape) => fitter.fit_shaped(self.camera, observation, shape).ok(),
            None => fitter.fit(self.camera, observation).ok(),
        }
    }

    /// The fit with the opposite heading.
    fn turned(
        &self,
        frame: &FrameKeypoints,
        fit: &ShapeFit,
        shapes: &[Option<TrackShape>; 2],
    ) -> Option<ShapeFit> {
        let other = fit.opposite?.camera_from_vehicle;
        let up = frame.observation.road.map_or_else(|| -Vector3::y(), |road| road.plane.up);
        let mut observation = frame.observation.clone();
        observation.heading = Some(HeadingEvidence::half_turn_about(&other, &up));
        let fit = self.fit(frame, &observation, shapes)?;
        let forward = |pose: &Pose<Camera, Vehicle>| pose.transform_vector(&Vector3::x());
        (forward(&fit.camera_from_vehicle).dot(&forward(&other)) > 0.0).then_some(fit)
    }

    /// Keypoints in a box of the track. Its edges do not enter: the box is a measurement of its own.
    fn in_frame(&self, seen: &TrackBox, class: VehicleClass) -> Option<FrameKeypoints> {
        let ground = self.grounds.get(seen.frame)?;
        let bbox = seen.observed.bbox;
        let keypoints = self.in_box(seen.frame, &bbox, VehicleKeypoints::any_found)?;
        let sigma_px = self.options.sigma_share * bbox.width().max(bbox.height());
        let mut observation = Observation::new(keypoints.points.clone(), sigma_px);
        let [ahead_m, left_m] = self.place_by_height(&bbox, class);
        let hills = ground.slope_change_sigma_rad * self.box_fit.slope_lengths(ahead_m);
        let of_plane = self.options.road_slope_sigma_rad.hypot(ground.pitch_sigma_rad).hypot(hills);
        let slope_sigma_rad =
            ground.road_ahead.map_or(of_plane, |road| road.sigma_m(ahead_m) / ahead_m.max(1.0));
        observation.road = Some(MeasuredRoad {
            plane: RoadPlane { height_m: ground.height_m - ground.rise(ahead_m).0, ..ground.road() },
            height_sigma_m: self.options.road_height_sigma_m.hypot(self.box_fit.level_sigma_m(left_m)),
            slope_sigma_rad,
        });
        observation.size = Some(self.sizes.prior(class));
        observation.heading = keypoints.heading.clone();
        let layout = usize::from(keypoints.layout == Layout::Car14);
        Some(FrameKeypoints { layout, observation })
    }

    /// Place of a vehicle, ahead and left, about as far away as the mean height of its class says \[m\].
    fn place_by_height(&self, bbox: &BoundingBox, class: VehicleClass) -> [f64; 2] {
        let ahead_m = self.camera.fy * size_prior(class).mean.height_m / bbox.height().max(1.0);
        let left_m = -ahead_m * (bbox.centre().0 - self.camera.cx) / self.camera.fx;
        [ahead_m, left_m]
    }

    /// The keypoints, of those asked for, whose bounding box overlaps a box most.
    fn in_box(
        &self,
        frame: usize,
        bbox: &BoundingBox,
        wanted: impl Fn(&VehicleKeypoints) -> bool,
    ) -> Option<&VehicleKeypoints> {
        let wanted = self.keypoints.get(frame)?.iter().filter(|k| wanted(k));
        let overlaps = wanted.map(|k| (k.bbox.iou(bbox), k));
        let enough = overlaps.filter(|(iou, _)| *iou > self.options.least_iou);
        enough.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, k)| k)
    }

    /// The shape that frames spread over the track agree on; `None` with too few frames.
    fn common_shape(&self, same: &[&FrameKeypoints], layout: usize) -> Option<TrackFit> {
        let count = same.len().min(self.options.shape_frames);
        let spread = (0..count).map(|i| same[i * same.len() / count].observation.clone());
        let (spread, similar) = (spread.collect::<Vec<_>>(), self.options.similar_views_rad);
        let fit = self.fitters[layout].fit_similar_views(self.camera, &spread, similar).ok()?;
        (fit.frames.iter().flatten().count() >= self.options.least_shape_frames).then_some(fit)
    }
}

/// The size of a track's shape as a prior for its boxes, not wider than that of the class.
fn size(fit: &TrackFit, class: &SizePrior, options: &KeypointViewOptions) -> SizePrior {
    let sigma = fit.size_covariance.diagonal().map(|v| v.max(0.0).sqrt().max(options.least_size_sigma_m));
    let sigma = sigma.zip_map(&class.sigma.to_vector(), f64::min);
    SizePrior { mean: fit.dimensions, sigma: Dimensions::from_vector(&sigma) }
}

fn heading_vote(fit: &ShapeFit) -> Vote {
    let forward = fit.camera_from_vehicle.transform_vector(&Vector3::x());
    Vote { forward, margin: fit.heading_margin().max(0.0) }
}

/// The view of a fit, moved to where the vehicle stands if it has the size `dimensions`.
fn view(
    frame: usize,
    fit: &ShapeFit,
    dimensions: Option<Dimensions>,
    options: &KeypointViewOptions,
) -> ExternalView {
    let r = fit.camera_from_vehicle.rotation_matrix();
    let position: Matrix3<f64> = fit.covariance.fixed_view::<3, 3>(3, 3).into_owned();
    let factor = options.variance_factor;
    let mut size_dependence = size_dependence(fit, factor);
    let mut position_in_camera = fit.camera_from_vehicle.translation();
    if let (Some(by), Some(size)) = (&mut size_dependence, dimensions) {
        position_in_camera += by.slope * (size.to_vector() - by.size.to_vector());
        by.size = size;
    }
    ExternalView {
        frame,
        position_in_camera: Point3::from(position_in_camera),
        forward_in_camera: r.column(0).into_owned(),
        covariance: r * position * r.transpose() * factor,
        heading_sigma_rad: fit.covariance[(2, 2)].max(0.0).sqrt().max(options.least_heading_sigma_rad),
        size_dependence,
        scale_sigma: 0.0,
        source: Source::Keypoints,
    }
}

/// Conditional mean and covariance of the position given the size, slope `Σ_ps Σ_ss⁻¹`; `None` for a prior of fixed size.
/// `variance_factor` multiplies the variance.
fn size_dependence(fit: &ShapeFit, variance_factor: f64) -> Option<SizeDependence> {
    let r = fit.camera_from_vehicle.rotation_matrix();
    let cross = fit.pose_size_covariance.fixed_view::<3, 3>(3, 0).into_owned();
    let slope = cross * fit.size_covariance.try_inverse()?;
    let held = fit.covariance.fixed_view::<3, 3>(3, 3) - slope * cross.transpose();
    Some(SizeDependence {
        size: fit.dimensions,
        slope: r * slope,
        covariance: r * held * r.transpose() * variance_factor,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observed_box::ObservedBox;
    use motorcade_geometry::robust::median;
    use motorcade_geometry::{Camera, Pose, Vehicle};
    use motorcade_perception::BoxConvention;
    use motorcade_shape::{BodyType, ObservedKeypoint, project};
    use motorcade_testing::CAMERA;
    use nalgebra::{Point2, Vector2, Vector3};

    /// An approaching saloon on a level road, its keypoints off by up to 3 px: all views have its one shape, and err less than
    /// fits of single frames.
    #[test]
    fn frames_of_a_track_share_one_shape() {
        let prior = ShapePrior::of_family(Layout::Car14);
        let shape = prior.coefficients_of(BodyType::Saloon).unwrap();
        let pose = |k: usize| {
            let (sin, cos) = (0.5 + 0.02 * k as f64).sin_cos();
            let columns =
                [Vector3::new(-sin, 0.0, cos), Vector3::new(-cos, 0.0, -sin), Vector3::new(0.0, -1.0, 0.0)];
            let position = Vector3::new(-3.0, 1.65, 26.0 - k as f64);
            Pose::<Camera, Vehicle>::from_matrix(&Matrix3::from_columns(&columns), &position)
        };
        let ground = GroundFrame {
            world_from_camera: Pose::identity(),
            up: -Vector3::y(),
            height_m: 1.65,
            pitch_sigma_rad: 0.003,
            slope_change_sigma_rad: 0.0,
            road_ahead: None,
            time_s: 0.0,
        };
        let (mut detected, mut boxes) = (Vec::new(), Vec::new());
        for k in 0..18 {
            let points: Vec<ObservedKeypoint> = project(&prior, shape, &pose(k), &CAMERA)
                .iter()
                .enumerate()
                .map(|(i, p)| {
                    // Deterministic scatter: multiples of the golden section.
                    let off = |n: usize| 6.0 * ((0.618_034 * n as f64).fract() - 0.5);
                    let pixel =
                        p.pixel.unwrap() + Vector2::new(off(31 * k + 7 * i), off(17 * k + 11 * i + 5));
                    ObservedKeypoint::new(pixel, f64::from(u8::from(p.visible)))
                })
                .collect();
            let keypoints = VehicleKeypoints::around_points(Layout::Car14, points).unwrap();
            let observed = ObservedBox {
                bbox: keypoints.bbox,
                class: VehicleClass::Car,
                convention: BoxConvention::VisibleExtent,
                edges: [true; 4],
                pixel_size: 1.0,
                road_below: None,
            };
            boxes.push(TrackBox { frame: k, observed, score: 1.0 });
            detected.push(vec![keypoints]);
        }
        let (grounds, options) = ([ground; 18], AdvancedVehicleOptions::default());
        let by_frame: Vec<&[VehicleKeypoints]> = detected.iter().map(Vec::as_slice).collect();
        let fitters = KeypointFitters::new(None, &options);
        let views = KeypointViews::new(&by_frame, &fitters, &CAMERA, &grounds, &options);
        let track = Track::new(1, VehicleClass::Car, boxes);
        let external = views.of_track(&track);

        let mut none = options;
        none.keypoints.enabled = false;
        let none = KeypointViews::new(&by_frame, &fitters, &CAMERA, &grounds, &none).of_track(&track);
        assert!(none.views.is_empty() && none.size.is_none());

        let length_m = prior.dimensions(shape).length_m;
        let (found, class) = (external.size.unwrap().mean, size_prior(VehicleClass::Car).mean);
        assert!((found.length_m - length_m).abs() < 0.5 * (class.length_m - length_m).abs(), "{found:?}");
        assert!(external.views.len() >= 15);
        assert!(external.views.iter().all(|v| v.size_dependence.unwrap().size == found));
        let error_m = |frame: usize, position: &Vector3<f64>| (position - pose(frame).translation()).norm();
        let mut shared: Vec<f64> =
            external.views.iter().map(|v| error_m(v.frame, &v.position_in_camera.coords)).collect();
        let single = |b: &TrackBox| {
            let frame = views.in_frame(b, track.class)?;
            let fit = views.fitters[frame.layout].fit(&CAMERA, &frame.observation).ok()?;
            Some(error_m(b.frame, &fit.camera_from_vehicle.translation()))
        };
        let mut single: Vec<f64> = track.boxes.iter().filter_map(single).collect();
        let (shared, single) = (median(&mut shared).unwrap(), median(&mut single).unwrap());
        assert!(shared < 0.8 * single, "{shared} {single}");

        // In a window of six frames that moves on, keypoints that are fitted once, as they come, are within a tenth of those of each
        // window fitted anew.
        let mut known = KeypointTrack::new(track.class);
        let (mut once, mut anew) = (Vec::new(), Vec::new());
        for end in 1..=track.boxes.len() {
            let first = end.saturating_sub(6);
            known.advance(first);
            let window = track.with_boxes(track.id, track.boxes[first..end].to_vec());
            let of_newest = |found: &ExternalTrack| {
                assert!(found.views.iter().all(|v| v.frame >= first));
                let view = found.views.last().filter(|v| v.frame + 1 == end)?;
                Some(error_m(view.frame, &view.position_in_camera.coords))
            };
            once.extend(of_newest(&views.of_known(&window, &mut known, &|frame| frame)));
            anew.extend(of_newest(&views.of_track(&window)));
        }
        let (once_m, anew_m) = (median(&mut once).unwrap(), median(&mut anew).unwrap());
        assert!(once.len() >= 15 && once_m < 1.1 * anew_m, "{once_m} {anew_m}");
        let size = known.size().unwrap().dimensions;
        assert!((size.length_m - found.length_m).abs() < 0.1, "{size:?} {found:?}");
    }

    #[test]
    fn keypoints_belong_to_the_box_around_them() {
        let corners = |left: f64| {
            let mut points = vec![ObservedKeypoint::missing(); 14];
            for (i, (x, y)) in [(0.0, 0.0), (80.0, 0.0), (80.0, 60.0), (0.0, 60.0)].into_iter().enumerate() {
                points[i] = ObservedKeypoint::new(Point2::new(left + x, 200.0 + y), 0.8);
            }
            VehicleKeypoints::around_points(Layout::Car14, points).unwrap()
        };
        // A box about the second one that gives its presence alone, as of a lorry.
        let presence = VehicleKeypoints {
            points: vec![ObservedKeypoint::missing(); 14],
            bbox: BoundingBox::new([395.0, 195.0, 485.0, 265.0]),
            presence: Some(-2.0),
            ..corners(400.0)
        };
        let frame = [corners(100.0), corners(400.0), presence];
        let (by_frame, options): ([&[VehicleKeypoints]; 1], _) =
            ([&frame], AdvancedVehicleOptions::default());
        let fitters = KeypointFitters::new(None, &options);
        let views = KeypointViews::new(&by_frame, &fitters, &CAMERA, &[], &options);
        let found = |frame, x1: f64| {
            let bbox = BoundingBox::new([x1, 195.0, x1 + 90.0, 265.0]);
            views.in_box(frame, &bbox, VehicleKeypoints::any_found)
        };
        assert_eq!(found(0, 395.0).unwrap().bbox.x1, 400.0);
        assert!(found(0, 700.0).is_none() && found(1, 395.0).is_none());
        let presence_at = |x1: f64| {
            let observed = ObservedBox {
                bbox: BoundingBox::new([x1, 195.0, x1 + 90.0, 265.0]),
                class: VehicleClass::Truck,
                convention: BoxConvention::VisibleExtent,
                edges: [true; 4],
                pixel_size: 1.0,
                road_below: None,
            };
            views.presence(&Track::new(
                1,
                VehicleClass::Truck,
                vec![TrackBox { frame: 0, observed, score: 1.0 }],
            ))
        };
        assert_eq!([presence_at(390.0), presence_at(95.0)], [Some(-2.0), None]);
    }
}
