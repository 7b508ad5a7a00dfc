//! Simulated output of a keypoint network.

use motorcade_shape::{Layout, VISIBLE_COSINE};
use nalgebra::{Point2, Point3};

use super::{FrameOutlines, Noise};
use crate::drive::Drive;
use crate::form::named_keypoints;

/// Errors of the keypoint network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeypointOptions {
    /// Standard deviation of a clearly visible keypoint, constant part \[px\].
    pub sigma_px: f64,
    /// Further part, as a share of the height of the vehicle's box: networks take crops of one size.
    pub sigma_share: f64,
    /// Probability that a keypoint is confused with its mirror image on the other side.
    pub swap_chance: f64,
    /// Least height of vehicles with keypoints \[px\].
    pub least_height_px: f64,
    /// Exact positions, also beyond the border of the image, and confidences of 1 for clearly visible keypoints, 0.2 for
    /// self-occluded ones, 0.1 for those occluded by another vehicle, 0.05 outside; without the errors above.
    pub exact: bool,
}

impl KeypointOptions {
    /// No errors.
    pub fn exact() -> Self {
        Self { exact: true, ..Self::default() }
    }
}

impl Default for KeypointOptions {
    fn default() -> Self {
        Self { sigma_px: 0.6, sigma_share: 0.015, swap_chance: 0.02, least_height_px: 20.0, exact: false }
    }
}

/// One keypoint of one vehicle in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct KeypointMeasurement {
    /// Frame of the drive.
    pub frame: usize,
    /// Identity of the vehicle, that of its label.
    pub track_id: u32,
    /// Keypoint layout.
    pub layout: Layout,
    /// Index in the layout.
    pub index: usize,
    /// Name, with its side.
    pub name: &'static str,
    /// Position by the network \[px\].
    pub pixel: Point2<f64>,
    /// Confidence, 0 to 1: about 0.8 when clearly visible, below 0.35 when self-occluded, occluded by another vehicle or outside
    /// the image.
    pub confidence: f64,
}

/// Simulated layouts, in this order.
const LAYOUTS: [Layout; 2] = [Layout::Car36, Layout::Car14];

/// Visibility of a keypoint.
#[derive(Clone, Copy, PartialEq)]
enum Visibility {
    Clear { facing: f64 },
    SelfOccluded,
    Occluded,
    Outside,
}

impl Visibility {
    /// Confidence without errors.
    fn certain(self) -> f64 {
        match self {
            Self::Clear { .. } => 1.0,
            Self::SelfOccluded => 0.2,
            Self::Occluded => 0.1,
            Self::Outside => 0.05,
        }
    }
}

/// Keypoints of the vehicles of a frame in both layouts. `hidden(vehicle, pixel, depth_m)` is true when something else
/// occludes a point.
pub(crate) fn of_frame(
    drive: &Drive,
    frame: usize,
    outlines: &FrameOutlines,
    options: &KeypointOptions,
    hidden: &dyn Fn(usize, &Point2<f64>, f64) -> bool,
) -> Vec<KeypointMeasurement> {
    let mut noise = Noise::of(drive.traffic_seed, 0x6e79, frame);
    let camera = outlines.camera;
    let mut out = Vec::new();
    for vehicle_view in &outlines.vehicles {
        let Some(vehicle) = drive.vehicles.get(vehicle_view.vehicle) else { continue };
        let box_px = vehicle_view.whole.height();
        if box_px < options.least_height_px {
            continue;
        }
        let eye = Point3::from(vehicle_view.pose.inverse().translation());
        for layout in LAYOUTS {
            let known = named_keypoints(layout);
            let Some(places) = vehicle.keypoints(layout) else { continue };
            let pixel = |i: usize| {
                let in_camera = vehicle_view.pose.transform_point(places.get(i)?);
                Some((camera.project(&in_camera)?, in_camera.z))
            };
            let mut found = Vec::new();
            let mut plain = 0;
            for (index, (keypoint, place)) in known.iter().zip(&places).enumerate() {
                let Some((at, depth_m)) = pixel(index) else { continue };
                let to_eye = eye - place;
                let facing = keypoint
                    .faces
                    .iter()
                    .map(|f| f.dot(&to_eye) / to_eye.norm().max(1e-9))
                    .fold(-1.0, f64::max);
                let sight = if !camera.contains(&at, 0.0) {
                    Visibility::Outside
                } else if hidden(vehicle_view.vehicle, &at, depth_m) {
                    Visibility::Occluded
                } else if facing <= VISIBLE_COSINE {
                    Visibility::SelfOccluded
                } else {
                    plain += 1;
                    Visibility::Clear { facing }
                };
                let track_id = vehicle.id;
                let name = keypoint.name.as_str();
                if options.exact {
                    let confidence = sight.certain();
                    let exact =
                        KeypointMeasurement { frame, track_id, layout, index, name, pixel: at, confidence };
                    found.push(exact);
                    continue;
                }
                let (spread, confidence) = error_and_confidence(sight, box_px, &mut noise);
                let sigma = spread * (options.sigma_px + options.sigma_share * box_px);
                // A swapped keypoint has the confidence of a right one.
                let swapped = noise.unit() < options.swap_chance;
                let at = if swapped { pixel(keypoint.mirror).map_or(at, |p| p.0) } else { at };
                let at = Point2::new(at.x + sigma * noise.normal(), at.y + sigma * noise.normal());
                // Networks answer within the image only.
                let pixel = Point2::new(
                    at.x.clamp(-0.5, f64::from(camera.width) - 0.5),
                    at.y.clamp(-0.5, f64::from(camera.height) - 0.5),
                );
                found.push(KeypointMeasurement { frame, track_id, layout, index, name, pixel, confidence });
            }
            // No keypoints for a vehicle that is not visible.
            if plain > 0 {
                out.extend(found);
            }
        }
    }
    out
}

/// Factor on the standard deviation of the position, and confidence.
fn error_and_confidence(sight: Visibility, box_px: f64, noise: &mut Noise) -> (f64, f64) {
    let near = (box_px / 45.0).min(1.0);
    let (spread, mean, sigma) = match sight {
        Visibility::Clear { facing } => {
            // Faces at grazing angles are narrow in the image: their points are less precise.
            let open = (facing / 0.4).min(1.0);
            (1.0 + 0.8 * (1.0 - open), 0.45 + 0.28 * near + 0.15 * open, 0.06)
        }
        // Networks predict self-occluded points by symmetry: imprecisely, with low confidence.
        Visibility::SelfOccluded => (3.0, 0.18, 0.06),
        Visibility::Occluded => (4.0, 0.12, 0.05),
        Visibility::Outside => (4.0, 0.06, 0.03),
    };
    (spread, (mean + sigma * noise.normal()).clamp(0.01, 0.99))
}
