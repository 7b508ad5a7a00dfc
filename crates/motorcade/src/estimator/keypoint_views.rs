//! Poses of vehicles from their keypoints, by the shape prior (the paper's eqs. 6–8).

use motorcade_geometry::PinholeCamera;
use motorcade_perception::{BoundingBox, VehicleClass, VehicleKeypoints};
use motorcade_shape::{
    Dimensions, FitOptions, Layout, Observation, RoadPlane, ShapeFit, ShapeFitter, ShapePrior, SizePrior,
    TrackFit,
};
use motorcade_vehicles::{
    BySize, ExternalTrack, ExternalView, GroundFrame, Source, Track, TrackBox, size_prior,
};
use nalgebra::{Matrix3, Point3};

/// Keypoints that belong to a box: of those that overlap with it, the ones that overlap most.
fn in_box<'k>(keypoints: &'k [VehicleKeypoints], bbox: &BoundingBox) -> Option<&'k VehicleKeypoints> {
    const LEAST_IOU: f64 = 0.4;
    let sets = keypoints.iter().map(|k| (k.bbox.iou(bbox), k));
    sets.filter(|(iou, _)| *iou > LEAST_IOU).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, k)| k)
}

/// The keypoints of a track in one frame, ready to be fitted.
struct TrackKeypoints {
    frame: usize,
    layout: Layout,
    observation: Observation,
}

/// Fits the shape prior to the keypoints of tracks.
pub(crate) struct KeypointViews<'a> {
    keypoints: &'a [Vec<VehicleKeypoints>],
    camera: &'a PinholeCamera,
    grounds: &'a [GroundFrame],
    /// One a layout; absent where no frame has keypoints.
    fitters: Option<[ShapeFitter; 2]>,
}

/// Neighbouring frames err alike beside the shape they share: a network misplaces a point as it did in the frame before.
/// Variances are that many times what a single frame tells.
const CORRELATED_FRAMES: f64 = 2.0;
/// Frames whose common shape is sought: a network misplaces the same point of the same car in the same way every time, so that
/// more would only seem to tell more.
const SPREAD_FRAMES: usize = 12;
/// How much less is known of a track's shape than the fit says: sizes of six cars of KITTI, by a network of 14 keypoints, are off by
/// two to three of its standard deviations.
const WIDENED: f64 = 2.5;
/// Fewer have no common shape worth the name.
const LEAST_FRAMES: usize = 3;
/// Share of a vehicle's box that a keypoint is placed to, one standard deviation: 2 px of a 64 px heat map.
const SIGMA_OF_BOX: f64 = 0.03;

impl<'a> KeypointViews<'a> {
    /// Keypoints and ground by frame of the window; `prior` takes the place of the built-in one of its layout.
    pub(crate) fn new(
        keypoints: &'a [Vec<VehicleKeypoints>],
        prior: Option<&ShapePrior>,
        camera: &'a PinholeCamera,
        grounds: &'a [GroundFrame],
    ) -> Self {
        let fitter = |layout: Layout| {
            let fits = |p: &&ShapePrior| p.keypoints().len() == layout.count();
            let prior = prior.filter(fits).cloned();
            ShapeFitter::new(prior.unwrap_or_else(|| ShapePrior::of_family(layout)), FitOptions::default())
        };
        let fitters = keypoints
            .iter()
            .any(|frame| !frame.is_empty())
            .then(|| [fitter(Layout::Car36), fitter(Layout::Car14)]);
        Self { keypoints, camera, grounds, fitters }
    }

    /// A view for each frame of a track that has keypoints, all with the one shape they agree on; none of vehicles the prior
    /// knows nothing of.
    pub(crate) fn of_track(&self, track: &Track) -> ExternalTrack {
        let Some(fitters) = &self.fitters else { return ExternalTrack::default() };
        let known = matches!(track.class, VehicleClass::Car | VehicleClass::Van);
        let seen = |b: &TrackBox| self.seen(b, track.class);
        let seen: Vec<TrackKeypoints> = track.boxes.iter().filter(|_| known).filter_map(seen).collect();
        // The rare track in both layouts has a shape in each.
        let found = [Layout::Car36, Layout::Car14]
            .map(|layout| self.shape_of_track(fitter_of(fitters, layout), &seen, layout));
        let shapes = found.each_ref().map(|track| track.as_ref().map(|track| track.shape.widened(WIDENED)));
        let fit = |s: &TrackKeypoints| {
            let fitter = fitter_of(fitters, s.layout);
            let fit = match &shapes[usize::from(s.layout == Layout::Car14)] {
                Some(shape) => fitter.fit_shaped(self.camera, &s.observation, shape),
                None => fitter.fit(self.camera, &s.observation),
            };
            fit.ok().filter(|fit| !fit.heading_is_ambiguous()).map(|fit| view(s.frame, &fit))
        };
        let views = seen.iter().filter_map(fit).collect();
        ExternalTrack { views, size: found.iter().flatten().next().map(|fit| size(fit, track.class)) }
    }

    fn seen(&self, seen: &TrackBox, class: VehicleClass) -> Option<TrackKeypoints> {
        let ground = self.grounds.get(seen.frame)?;
        let bbox = seen.seen.bbox;
        let set = in_box(self.keypoints.get(seen.frame)?, &bbox)?;
        // The box's edges do not enter here: the box is a measurement of its own.
        let mut observation =
            Observation::new(set.points.clone(), SIGMA_OF_BOX * bbox.width().max(bbox.height()));
        observation.road = Some(road(ground));
        observation.size = Some(size_prior(class));
        Some(TrackKeypoints { frame: seen.frame, layout: set.layout, observation })
    }

    /// The shape that frames spread over the track agree on; `None` when it was seen in too few.
    fn shape_of_track(
        &self,
        fitter: &ShapeFitter,
        seen: &[TrackKeypoints],
        layout: Layout,
    ) -> Option<TrackFit> {
        let same: Vec<&TrackKeypoints> = seen.iter().filter(|s| s.layout == layout).collect();
        let some = same.len().min(SPREAD_FRAMES);
        let spread = (0..some).map(|i| same[i * same.len() / some].observation.clone());
        let fit = fitter.fit_track(self.camera, &spread.collect::<Vec<_>>()).ok()?;
        (fit.frames.iter().flatten().count() >= LEAST_FRAMES).then_some(fit)
    }
}

fn fitter_of(fitters: &[ShapeFitter; 2], layout: Layout) -> &ShapeFitter {
    &fitters[usize::from(layout == Layout::Car14)]
}

/// The size of a track's shape as a prior for its boxes.
fn size(fit: &TrackFit, class: VehicleClass) -> SizePrior {
    /// Sizes of an outline mean no more \[m\].
    const LEAST_M: f64 = 0.02;
    let class = size_prior(class).sigma.to_vector();
    let found = fit.size_covariance.diagonal().map(|v| (WIDENED * v.max(0.0).sqrt()).max(LEAST_M));
    let sigma = found.zip_map(&class, f64::min);
    SizePrior { mean: fit.dimensions, sigma: Dimensions::from_vector(&sigma) }
}

fn road(ground: &GroundFrame) -> RoadPlane {
    // What a street's slope changes by over 20 m, besides what this frame's pitch is uncertain by.
    const SLOPE_RAD: f64 = 0.0035;
    RoadPlane {
        slope_sigma_rad: SLOPE_RAD.hypot(ground.pitch_sigma_rad),
        up: ground.up,
        ..RoadPlane::level(ground.height_m)
    }
}

fn view(frame: usize, fit: &ShapeFit) -> ExternalView {
    let r = fit.camera_from_vehicle.rotation_matrix();
    let place: Matrix3<f64> = fit.covariance.fixed_view::<3, 3>(3, 3).into_owned();
    ExternalView {
        frame,
        position_in_camera: Point3::from(fit.camera_from_vehicle.translation()),
        forward_in_camera: r.column(0).into_owned(),
        covariance: r * place * r.transpose() * CORRELATED_FRAMES,
        heading_sigma_rad: fit.covariance[(2, 2)].max(0.0).sqrt().max(0.05),
        by_size: by_size(fit),
        scale_sigma: 0.0,
        source: Source::Keypoints,
    }
}

/// How the place depends on the size: the mean of the one given the other, `Σ_ps Σ_ss⁻¹`. `None` for a prior whose size is fixed.
fn by_size(fit: &ShapeFit) -> Option<BySize> {
    let r = fit.camera_from_vehicle.rotation_matrix();
    let across = fit.pose_size_covariance.fixed_view::<3, 3>(3, 0).into_owned();
    let slope = across * fit.size_covariance.try_inverse()?;
    let held = fit.covariance.fixed_view::<3, 3>(3, 3) - slope * across.transpose();
    Some(BySize {
        size: fit.dimensions,
        slope: r * slope,
        covariance: r * held * r.transpose() * CORRELATED_FRAMES,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_geometry::robust::median;
    use motorcade_geometry::{Camera, Pose, Vehicle};
    use motorcade_perception::BoxConvention;
    use motorcade_shape::{BodyType, ObservedKeypoint, project};
    use motorcade_vehicles::ObservedBox;
    use nalgebra::{Vector2, Vector3};

    #[test]
    fn keypoints_are_found_by_the_box_around_them() {
        let set = |left: f64| VehicleKeypoints {
            layout: Layout::Car14,
            points: Vec::new(),
            bbox: BoundingBox::new([left, 200.0, left + 80.0, 260.0]),
        };
        let both = [set(100.0), set(400.0)];
        let found = in_box(&both, &BoundingBox::new([395.0, 195.0, 485.0, 265.0])).unwrap();
        assert_eq!(found.bbox.x1, 400.0);
        assert!(in_box(&both, &BoundingBox::new([700.0, 195.0, 785.0, 265.0])).is_none());
    }

    /// A saloon that comes nearer on a level road, its keypoints off by up to 3 px: all views have its one shape, and are
    /// closer than fits of single frames.
    #[test]
    fn frames_of_a_track_share_one_shape() {
        let camera = PinholeCamera { fx: 720.0, fy: 720.0, cx: 610.0, cy: 175.0, width: 1242, height: 375 };
        let prior = ShapePrior::of_family(Layout::Car14);
        let shape = prior.coefficients_of(BodyType::Saloon).unwrap();
        let pose = |k: usize| {
            let (sin, cos) = (0.5 + 0.02 * k as f64).sin_cos();
            let columns =
                [Vector3::new(-sin, 0.0, cos), Vector3::new(-cos, 0.0, -sin), Vector3::new(0.0, -1.0, 0.0)];
            let place = Vector3::new(-3.0, 1.65, 26.0 - k as f64);
            Pose::<Camera, Vehicle>::from_matrix(&Matrix3::from_columns(&columns), &place)
        };
        let ground = GroundFrame {
            world_from_camera: Pose::identity(),
            up: -Vector3::y(),
            height_m: 1.65,
            pitch_sigma_rad: 0.003,
            time_s: 0.0,
        };
        let mut keypoints = Vec::new();
        let mut boxes = Vec::new();
        for k in 0..18 {
            let points: Vec<ObservedKeypoint> = project(&prior, shape, &pose(k), &camera)
                .iter()
                .enumerate()
                .map(|(i, p)| {
                    // Scattered without a generator: multiples of the golden section.
                    let off = |n: usize| 6.0 * ((0.618_034 * n as f64).fract() - 0.5);
                    let pixel =
                        p.pixel.unwrap() + Vector2::new(off(31 * k + 7 * i), off(17 * k + 11 * i + 5));
                    ObservedKeypoint { pixel, confidence: f64::from(u8::from(p.visible)) }
                })
                .collect();
            let set = VehicleKeypoints::around_points(Layout::Car14, points).unwrap();
            let seen = ObservedBox {
                bbox: set.bbox,
                class: VehicleClass::Car,
                convention: BoxConvention::VisibleExtent,
                edges: [true; 4],
            };
            boxes.push(TrackBox { frame: k, seen, score: 1.0 });
            keypoints.push(vec![set]);
        }
        let grounds = [ground; 18];
        let views = KeypointViews::new(&keypoints, None, &camera, &grounds);
        let track = Track { id: 1, class: VehicleClass::Car, boxes };
        let given = views.of_track(&track);

        let length_m = prior.dimensions(shape).length_m;
        let (found, class) = (given.size.unwrap().mean, size_prior(VehicleClass::Car).mean);
        assert!((found.length_m - length_m).abs() < 0.5 * (class.length_m - length_m).abs(), "{found:?}");
        assert!(given.views.len() >= 15);
        assert!(given.views.iter().all(|v| v.by_size.unwrap().size == found));
        let miss = |frame: usize, place: &Vector3<f64>| (place - pose(frame).translation()).norm();
        let mut shared: Vec<f64> =
            given.views.iter().map(|v| miss(v.frame, &v.position_in_camera.coords)).collect();
        let single = |b: &TrackBox| {
            let seen = views.seen(b, track.class)?;
            let fit = fitter_of(views.fitters.as_ref()?, seen.layout).fit(&camera, &seen.observation).ok()?;
            Some(miss(b.frame, &fit.camera_from_vehicle.translation()))
        };
        let mut single: Vec<f64> = track.boxes.iter().filter_map(single).collect();
        let (shared, single) = (median(&mut shared).unwrap(), median(&mut single).unwrap());
        assert!(shared < 0.8 * single, "{shared} {single}");
    }
}
