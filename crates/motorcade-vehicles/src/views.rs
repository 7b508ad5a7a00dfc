//! What each frame says of a vehicle's place, whatever its source.

use motorcade_geometry::PinholeCamera;
use motorcade_shape::{Dimensions, SizePrior};
use nalgebra::{Matrix3, Matrix6, Point3, Vector3, Vector6};

use crate::ground::GroundFrame;
use crate::joint_size::JointSize;
use crate::motion::PositionMeasurement;
use crate::silhouette::standing_pose;
use crate::single_view::{SingleView, locate_sized};
use crate::tracker::{Track, TrackBox};
use crate::trajectory::{ExternalTrack, ExternalView, Scaling, Sighting, Source, VehicleMeasurement};

/// A box takes its heading from the way the vehicle goes or from standing along the road: 2° at best, as in its states.
const HEADING_SIGMA_RAD: f64 = 0.035;
/// Upright on the road, whose cross-fall and crown are a degree or two.
const TILT_SIGMA_RAD: f64 = 0.03;

/// All that is given of one vehicle.
pub(crate) struct TrackInput<'a> {
    pub(crate) camera: &'a PinholeCamera,
    pub(crate) grounds: &'a [GroundFrame],
    pub(crate) track: &'a Track,
    pub(crate) given: &'a ExternalTrack,
    /// Size of its class, or what is given of its own.
    pub(crate) prior: SizePrior,
    /// First frame.
    pub(crate) start: usize,
}

impl TrackInput<'_> {
    /// χ² of the edges of all boxes that tell something, as of a dozen independent ones, and of the size against what was known of
    /// it; and how many times worse than their deviations say that is, 1 where the boxes fit.
    fn misfit(&self, boxes: &[(usize, SingleView)], size: &JointSize) -> (f64, f64) {
        const INDEPENDENT: f64 = 12.0;
        /// χ² of a box that fits: with place and size free few freedoms are left.
        const FITS: f64 = 2.0;
        let count = self.track.boxes.iter().filter(|b| b.seen.tells()).count().max(boxes.len());
        let unplaced = (count - boxes.len()) as f64 * UNEXPLAINED;
        let edges = boxes.iter().map(|(_, view)| view.chi2.min(UNEXPLAINED)).sum::<f64>() + unplaced;
        let off = size.size.to_vector() - self.prior.mean.to_vector();
        let off = off.component_div(&self.prior.sigma.to_vector()).norm_squared();
        let independent = (count.max(1) as f64).min(INDEPENDENT);
        let misfit = edges * independent / count.max(1) as f64 + off;
        (misfit, (misfit / (FITS * independent)).max(1.0).sqrt())
    }

    /// Places every box with a size of this mean and information; headings are relative to each frame's camera.
    fn place_boxes(
        &self,
        headings: &[f64],
        mean: &Dimensions,
        size_information: &Matrix3<f64>,
    ) -> Vec<(usize, SingleView)> {
        let one = |b: &TrackBox| {
            let heading = headings.get(b.frame - self.start)?;
            let ground = self.grounds.get(b.frame)?;
            Some((b.frame, locate_sized(self.camera, ground, &b.seen, *heading, mean, size_information)?))
        };
        self.track.boxes.iter().filter_map(one).collect()
    }
}

/// All that one frame says of the place.
#[derive(Clone, Copy)]
pub(crate) struct View {
    pub(crate) frame: usize,
    pub(crate) position_in_camera: Point3<f64>,
    pub(crate) covariance: Matrix3<f64>,
}

pub(crate) struct Views {
    /// In order of frames.
    pub(crate) views: Vec<View>,
    pub(crate) size: JointSize,
    /// How badly the boxes fit with these headings: χ².
    pub(crate) misfit: f64,
    /// How many times worse than their deviations say that is; 1 where they fit.
    pub(crate) doubt: f64,
}

/// A box that nothing explains counts no more: χ² of its edges.
pub(crate) const UNEXPLAINED: f64 = 30.0;

impl Views {
    /// Places every box with the given headings, joins what all boxes say of the size, and places them again with it.
    pub(crate) fn of(story: &TrackInput<'_>, headings: &[f64]) -> Option<Self> {
        let place_all = |prior: &SizePrior| {
            let information = Matrix3::from_diagonal(&prior.sigma.to_vector().map(|s| 1.0 / (s * s)));
            story.place_boxes(headings, &prior.mean, &information)
        };
        let size = JointSize::of(&place_all(&story.prior), &story.prior)?;
        let boxes = place_all(&size.as_prior());
        let (misfit, doubt) = story.misfit(&boxes, &size);
        let views = fuse(&boxes, &story.given.views);
        (!views.is_empty()).then_some(Self { views, size, misfit, doubt })
    }

    /// Places in the world.
    pub(crate) fn places(&self, grounds: &[GroundFrame]) -> Vec<PositionMeasurement> {
        let one = |view: &View| {
            let ground = &grounds[view.frame];
            let r = ground.world_from_camera.rotation_matrix();
            PositionMeasurement {
                frame: view.frame,
                time_s: ground.time_s,
                position: ground.world_from_camera.transform_point(&view.position_in_camera).coords,
                covariance: r * view.covariance * r.transpose(),
                range_m: view.position_in_camera.coords.norm(),
            }
        };
        self.views.iter().map(one).collect()
    }

    /// What a frame says, all its sources together, of a vehicle whose nose points `forward` (camera frame).
    pub(crate) fn measured(
        &self,
        frame: usize,
        ground: &GroundFrame,
        forward: &Vector3<f64>,
    ) -> Option<VehicleMeasurement> {
        let view = self.views.iter().find(|v| v.frame == frame)?;
        let camera_from_vehicle = standing_pose(&view.position_in_camera, forward, &ground.up);
        let r = camera_from_vehicle.rotation_matrix();
        let covariance = pose_covariance(&(r.transpose() * view.covariance * r), HEADING_SIGMA_RAD);
        Some(VehicleMeasurement { camera_from_vehicle, covariance })
    }

    /// What each source of each frame says if the vehicle has the track's size, with the frame. Boxes take the headings
    /// (relative to each frame's camera), other sources have their own.
    pub(crate) fn sightings(&self, story: &TrackInput<'_>, headings: &[f64]) -> Vec<(usize, Sighting)> {
        let information = self.size.scale_held();
        let place = |information: &Matrix3<f64>| story.place_boxes(headings, &self.size.size, information);
        let boxes = information.as_ref().map_or_else(Vec::new, place);
        let of_box = |(frame, view): &(usize, SingleView)| {
            let ground = story.grounds.get(*frame)?;
            let forward = ground.direction_of(*headings.get(frame - story.start)?);
            Some((*frame, self.sighting_of_box(view, information.as_ref()?, ground, &forward)?))
        };
        let of_given = |given: &ExternalView| {
            let ground = story.grounds.get(given.frame)?;
            Some((given.frame, self.sighting_of_given(given, ground)))
        };
        boxes.iter().filter_map(of_box).chain(story.given.views.iter().filter_map(of_given)).collect()
    }

    fn sighting_of_box(
        &self,
        view: &SingleView,
        size_information: &Matrix3<f64>,
        ground: &GroundFrame,
        forward: &Vector3<f64>,
    ) -> Option<Sighting> {
        let by_scale = view.by_mean_size(size_information)? * self.size.size.to_vector();
        let pose = standing_pose(&view.position_in_camera, forward, &ground.up);
        let r = pose.rotation_matrix();
        let covariance = pose_covariance(&(r.transpose() * view.covariance * r), HEADING_SIGMA_RAD);
        // The place is that for this heading, and goes with it.
        let mut by_heading = Matrix6::identity();
        by_heading
            .fixed_view_mut::<3, 1>(3, 2)
            .copy_from(&(r.transpose() * view.by_heading(size_information)?));
        Some(Sighting {
            source: Source::Box,
            camera_from_vehicle: pose,
            covariance: by_heading * covariance * by_heading.transpose(),
            scaling: Scaling::Size,
            by_scale: tangent(&(r.transpose() * by_scale)),
        })
    }

    fn sighting_of_given(&self, given: &ExternalView, ground: &GroundFrame) -> Sighting {
        let size = self.size.size.to_vector();
        let (place, scaling, by_scale, covariance) = match given.by_size {
            Some(by) => {
                let proportions = by.slope * self.size.proportions() * by.slope.transpose();
                let shift = by.slope * (size - by.size.to_vector());
                let place = given.position_in_camera + shift;
                (place, Scaling::Size, by.slope * size, by.covariance + proportions)
            }
            None if given.scale_sigma > 0.0 => {
                let (place, sigma) = (given.position_in_camera, given.scale_sigma);
                let own = given.covariance - place.coords * place.coords.transpose() * sigma.powi(2);
                (place, Scaling::Source { sigma }, place.coords, own)
            }
            None => (given.position_in_camera, Scaling::Size, Vector3::zeros(), given.covariance),
        };
        let pose = standing_pose(&place, &given.forward_in_camera, &ground.up);
        let r = pose.rotation_matrix();
        Sighting {
            source: given.source,
            camera_from_vehicle: pose,
            covariance: pose_covariance(&(r.transpose() * covariance * r), given.heading_sigma_rad),
            scaling,
            by_scale: tangent(&(r.transpose() * by_scale)),
        }
    }
}

/// Of a vehicle upright on the road; place in the vehicle frame.
fn pose_covariance(place: &Matrix3<f64>, heading_sigma_rad: f64) -> Matrix6<f64> {
    let mut covariance = Matrix6::zeros();
    covariance[(0, 0)] = TILT_SIGMA_RAD * TILT_SIGMA_RAD;
    covariance[(1, 1)] = TILT_SIGMA_RAD * TILT_SIGMA_RAD;
    covariance[(2, 2)] = heading_sigma_rad * heading_sigma_rad;
    covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(place);
    covariance
}

/// A slope of the place as one of the tangent `[ω, ν]`.
fn tangent(slope: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(0.0, 0.0, 0.0, slope.x, slope.y, slope.z)
}

/// One view a frame: what boxes and given poses say, weighted by their covariances.
fn fuse(boxes: &[(usize, SingleView)], given: &[ExternalView]) -> Vec<View> {
    let mut all: Vec<View> = boxes
        .iter()
        .map(|(frame, v)| View {
            frame: *frame,
            position_in_camera: v.position_in_camera,
            covariance: v.covariance,
        })
        .collect();
    for g in given {
        let own = View { frame: g.frame, position_in_camera: g.position_in_camera, covariance: g.covariance };
        match all.iter_mut().find(|v| v.frame == g.frame) {
            Some(view) => {
                let informations = view.covariance.try_inverse().zip(g.covariance.try_inverse());
                let joint = informations.and_then(|(a, b)| Some((a, b, (a + b).try_inverse()?)));
                if let Some((a, b, covariance)) = joint {
                    let sum = a * view.position_in_camera.coords + b * g.position_in_camera.coords;
                    *view = View {
                        frame: g.frame,
                        position_in_camera: Point3::from(covariance * sum),
                        covariance,
                    };
                }
            }
            None => all.push(own),
        }
    }
    all.sort_by_key(|v| v.frame);
    all
}
