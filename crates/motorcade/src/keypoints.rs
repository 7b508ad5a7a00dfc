//! Keypoints of vehicles from a file, and what the shape prior makes of them (the paper's eqs. 6–8).
//!
//! CSV with a header; columns are found by name: `frame`, `track_id`, `layout` (`car-36` or `car-14`, see
//! [`motorcade_shape::Layout`]), `index` within the layout, `x_px`, `y_px`, `confidence` (0 to 1). The track identity only
//! says which points belong to one vehicle in a frame; which track that is the boxes tell.

use std::collections::BTreeMap;
use std::path::Path;

use motorcade_geometry::PinholeCamera;
use motorcade_perception::{BoundingBox, VehicleClass};
use motorcade_shape::{
    Dimensions, FitOptions, Layout, Observation, ObservedKeypoint, RoadPlane, ShapeFit, ShapeFitter,
    ShapePrior, SizePrior, TrackFit,
};
use motorcade_vehicles::{
    BySize, ExternalTrack, ExternalView, GroundFrame, Source, Track, TrackBox, size_prior,
};
use nalgebra::{Matrix3, Point2, Point3};
use serde::Deserialize;

use crate::error::{Error, Result};
use crate::pipeline::External;

/// The keypoints of one vehicle in one frame.
#[derive(Clone, Debug)]
struct KeypointSet {
    layout: Layout,
    points: Vec<ObservedKeypoint>,
    /// Around the points that were found.
    hull: BoundingBox,
}

/// Keypoints by the input's own frame number.
#[derive(Clone, Debug, Default)]
pub struct KeypointTable {
    frames: BTreeMap<u64, Vec<KeypointSet>>,
}

#[derive(Deserialize)]
struct Row {
    frame: u64,
    track_id: i64,
    layout: String,
    index: usize,
    x_px: f64,
    y_px: f64,
    confidence: f64,
}

/// A keypoint less certain than this is not looked at when points are matched with boxes.
const FOUND: f64 = 0.3;

impl KeypointTable {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that does not read, a missing column, an unknown layout, an index beyond it, a number that is none (file and
    /// line are named).
    pub fn read(path: &Path) -> Result<Self> {
        let expected = "expected columns frame, track_id, layout, index, x_px, y_px, confidence";
        let at = |line: u64, what: String| Error::Input(format!("{}:{line}: {what}", path.display()));
        let problem = |e: csv::Error| {
            let line = e.position().map_or(1, csv::Position::line);
            at(line, format!("{expected}: {e}"))
        };
        let mut sets: BTreeMap<(u64, i64), BTreeMap<usize, Vec<ObservedKeypoint>>> = BTreeMap::new();
        let mut reader = csv::Reader::from_path(path).map_err(problem)?;
        for (k, row) in reader.deserialize().enumerate() {
            let row: Row = row.map_err(problem)?;
            let line = k as u64 + 2;
            let Some(layout) = layout(&row.layout) else {
                return Err(at(line, format!("layout `{}`; expected car-36 or car-14", row.layout)));
            };
            let count = layout.count();
            if row.index >= count {
                return Err(at(
                    line,
                    format!("index {}; {} has keypoints 0 to {}", row.index, row.layout, count - 1),
                ));
            }
            if !(0.0..=1.0).contains(&row.confidence) || !(row.x_px + row.y_px).is_finite() {
                return Err(at(line, "expected finite pixels and a confidence from 0 to 1".to_owned()));
            }
            let nothing = ObservedKeypoint { pixel: Point2::origin(), confidence: 0.0 };
            let points = sets.entry((row.frame, row.track_id)).or_default().entry(count);
            points.or_insert_with(|| vec![nothing; count])[row.index] =
                ObservedKeypoint { pixel: Point2::new(row.x_px, row.y_px), confidence: row.confidence };
        }
        let mut table = Self::default();
        for ((frame, _), mut layouts) in sets {
            // Of a vehicle given in both layouts the one that says more.
            let Some((count, points)) = layouts.pop_last() else { continue };
            let layout = if count == Layout::Car36.count() { Layout::Car36 } else { Layout::Car14 };
            if let Some(hull) = hull(&points) {
                table.frames.entry(frame).or_default().push(KeypointSet { layout, points, hull });
            }
        }
        Ok(table)
    }

    /// The set that lies in a box: most of its points inside, and filling it better than any other.
    fn in_box(&self, frame: u64, bbox: &BoundingBox) -> Option<&KeypointSet> {
        const LEAST_IOU: f64 = 0.4;
        let sets = self.frames.get(&frame)?.iter().map(|s| (s.hull.iou(bbox), s));
        sets.filter(|(iou, _)| *iou > LEAST_IOU).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, s)| s)
    }
}

fn layout(name: &str) -> Option<Layout> {
    match name {
        "car-36" => Some(Layout::Car36),
        "car-14" => Some(Layout::Car14),
        _ => None,
    }
}

fn hull(points: &[ObservedKeypoint]) -> Option<BoundingBox> {
    let found: Vec<&ObservedKeypoint> = points.iter().filter(|p| p.confidence >= FOUND).collect();
    let reach =
        |start: f64, f: fn(f64, f64) -> f64, axis: usize| found.iter().map(|p| p.pixel[axis]).fold(start, f);
    let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
    (found.len() >= 3).then(|| {
        let edges = [
            reach(low, f64::min, 0),
            reach(low, f64::min, 1),
            reach(high, f64::max, 0),
            reach(high, f64::max, 1),
        ];
        BoundingBox::new(edges)
    })
}

/// The keypoints of a track in one frame, ready to be fitted.
struct Seen {
    frame: usize,
    layout: Layout,
    observation: Observation,
}

/// Fits the shape prior to the keypoints of tracks.
pub(crate) struct KeypointViews<'a> {
    table: &'a KeypointTable,
    numbers: &'a [u64],
    camera: &'a PinholeCamera,
    grounds: &'a [GroundFrame],
    fitters: [ShapeFitter; 2],
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
    pub(crate) fn new(
        table: &'a KeypointTable,
        given: &External,
        numbers: &'a [u64],
        camera: &'a PinholeCamera,
        grounds: &'a [GroundFrame],
    ) -> Self {
        let fitter = |layout: Layout| {
            let fits = |p: &&ShapePrior| p.keypoints().len() == layout.count();
            let prior = given.shape_prior.as_ref().filter(fits).cloned();
            ShapeFitter::new(prior.unwrap_or_else(|| ShapePrior::of_family(layout)), FitOptions::default())
        };
        Self { table, numbers, camera, grounds, fitters: [fitter(Layout::Car36), fitter(Layout::Car14)] }
    }

    /// A view for each frame of a track that has keypoints, all with the one shape they agree on; none of vehicles the prior
    /// knows nothing of.
    pub(crate) fn of(&self, track: &Track) -> ExternalTrack {
        let known = matches!(track.class, VehicleClass::Car | VehicleClass::Van);
        let seen = |b: &TrackBox| self.seen(b, track.class);
        let seen: Vec<Seen> = track.boxes.iter().filter(|_| known).filter_map(seen).collect();
        // The rare track in both layouts has a shape in each.
        let found = [Layout::Car36, Layout::Car14].map(|layout| self.shape_of_track(&seen, layout));
        let shapes = found.each_ref().map(|track| track.as_ref().map(|track| track.shape.widened(WIDENED)));
        let fit = |s: &Seen| {
            let fitter = self.fitter(s.layout);
            let fit = match &shapes[usize::from(s.layout == Layout::Car14)] {
                Some(shape) => fitter.fit_shaped(self.camera, &s.observation, shape),
                None => fitter.fit(self.camera, &s.observation),
            };
            fit.ok().filter(|fit| !fit.heading_is_ambiguous()).map(|fit| view(s.frame, &fit))
        };
        let views = seen.iter().filter_map(fit).collect();
        ExternalTrack { views, size: found.iter().flatten().next().map(|fit| size(fit, track.class)) }
    }

    fn fitter(&self, layout: Layout) -> &ShapeFitter {
        &self.fitters[usize::from(layout == Layout::Car14)]
    }

    fn seen(&self, seen: &TrackBox, class: VehicleClass) -> Option<Seen> {
        let ground = self.grounds.get(seen.frame)?;
        let bbox = seen.seen.bbox;
        let set = self.table.in_box(*self.numbers.get(seen.frame)?, &bbox)?;
        // The box's edges do not enter here: the box is a measurement of its own.
        let mut observation =
            Observation::new(set.points.clone(), SIGMA_OF_BOX * bbox.width().max(bbox.height()));
        observation.road = Some(road(ground));
        observation.size = Some(size_prior(class));
        Some(Seen { frame: seen.frame, layout: set.layout, observation })
    }

    /// The shape that frames spread over the track agree on; `None` when it was seen in too few.
    fn shape_of_track(&self, seen: &[Seen], layout: Layout) -> Option<TrackFit> {
        let same: Vec<&Seen> = seen.iter().filter(|s| s.layout == layout).collect();
        let some = same.len().min(SPREAD_FRAMES);
        let spread = (0..some).map(|i| same[i * same.len() / some].observation.clone());
        let fit = self.fitter(layout).fit_track(self.camera, &spread.collect::<Vec<_>>()).ok()?;
        (fit.frames.iter().flatten().count() >= LEAST_FRAMES).then_some(fit)
    }
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
    use motorcade_shape::{BodyType, project};
    use motorcade_vehicles::ObservedBox;
    use nalgebra::{Vector2, Vector3};

    fn read(text: &str) -> Result<KeypointTable> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("keypoints.csv");
        std::fs::write(&path, text).unwrap();
        KeypointTable::read(&path)
    }

    const HEADER: &str = "frame,track_id,layout,index,name,x_px,y_px,confidence\n";

    #[test]
    fn sets_are_found_by_the_box_around_them() {
        let mut text = HEADER.to_owned();
        for (track, left) in [(1, 100.0), (2, 400.0)] {
            for (i, (x, y)) in [(0.0, 0.0), (80.0, 0.0), (80.0, 60.0), (0.0, 60.0)].into_iter().enumerate() {
                text += &format!("7,{track},car-14,{i},\"a, b\",{},{},0.8\n", left + x, 200.0 + y);
            }
        }
        let table = read(&text).unwrap();
        let set = table.in_box(7, &BoundingBox::new([395.0, 195.0, 485.0, 265.0])).unwrap();
        assert_eq!((set.hull.x1, set.layout, set.points.len()), (400.0, Layout::Car14, 14));
        assert!(table.in_box(7, &BoundingBox::new([700.0, 195.0, 785.0, 265.0])).is_none());
        assert!(table.in_box(8, &BoundingBox::new([395.0, 195.0, 485.0, 265.0])).is_none());
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
        let mut table = KeypointTable::default();
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
            let hull = hull(&points).unwrap();
            let seen = ObservedBox {
                bbox: hull,
                class: VehicleClass::Car,
                convention: BoxConvention::VisibleExtent,
                edges: [true; 4],
            };
            boxes.push(TrackBox { frame: k, seen, score: 1.0 });
            let set = KeypointSet { layout: Layout::Car14, points, hull };
            table.frames.insert(k as u64, vec![set]);
        }
        let (numbers, grounds): (Vec<u64>, _) = ((0..18).collect(), [ground; 18]);
        let views = KeypointViews::new(&table, &External::default(), &numbers, &camera, &grounds);
        let track = Track { id: 1, class: VehicleClass::Car, boxes };
        let given = views.of(&track);

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
            let fit = views.fitter(seen.layout).fit(&camera, &seen.observation).ok()?;
            Some(miss(b.frame, &fit.camera_from_vehicle.translation()))
        };
        let mut single: Vec<f64> = track.boxes.iter().filter_map(single).collect();
        let (shared, single) = (median(&mut shared).unwrap(), median(&mut single).unwrap());
        assert!(shared < 0.8 * single, "{shared} {single}");
    }

    #[test]
    fn problems_name_the_line() {
        let problem = |row: &str| read(&format!("{HEADER}{row}\n")).unwrap_err().to_string();
        assert!(problem("1,1,car-14,14,x,1,1,0.5").contains(":2: index 14"));
        assert!(problem("1,1,lorry,1,x,1,1,0.5").contains("expected car-36 or car-14"));
        assert!(problem("1,1,car-14,1,x,1,1,1.5").contains("confidence from 0 to 1"));
        assert!(problem("1,1,car-14,1,x,one,1,0.5").contains(":2"));
        assert!(read("frame,x\n1,2\n").unwrap_err().to_string().contains("x_px"));
    }
}
