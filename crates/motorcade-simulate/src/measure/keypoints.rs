//! Keypoints of vehicles as a network would find them.

use motorcade_shape::{Layout, VISIBLE_COSINE};
use nalgebra::{Point2, Point3};

use super::{Noise, Outlook};
use crate::drive::Drive;
use crate::form::named_keypoints;

/// How a keypoint network errs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeypointOptions {
    /// Standard deviation of a plainly seen keypoint \[px\] ...
    pub sigma_px: f64,
    /// ... to which comes this share of the height of the vehicle's box: networks look at crops of one size.
    pub sigma_share: f64,
    /// Chance that a keypoint is taken for its mirror image on the other side.
    pub swap_chance: f64,
    /// Vehicles lower than this have none \[px\].
    pub least_height_px: f64,
    /// True places, also beyond the border of the image, and confidences of 1 where a keypoint is plainly seen, 0.2 where
    /// the vehicle itself hides it, 0.1 where another one does, 0.05 outside; the errors above are not drawn.
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
    /// Which order of keypoints.
    pub layout: Layout,
    /// Place in the layout.
    pub index: usize,
    /// What it is, with its side.
    pub name: &'static str,
    /// Where the network says it is \[px\].
    pub pixel: Point2<f64>,
    /// 0 to 1: about 0.8 where it is plainly seen, below 0.35 where the vehicle itself, another one or the border of the
    /// image hides it.
    pub confidence: f64,
}

/// Layouts that are measured, in this order.
const LAYOUTS: [Layout; 2] = [Layout::Car36, Layout::Car14];

/// How a place can be seen.
#[derive(Clone, Copy, PartialEq)]
enum Sight {
    Plain { facing: f64 },
    BehindItself,
    BehindOther,
    Outside,
}

impl Sight {
    /// Confidence of one who knows.
    fn certain(self) -> f64 {
        match self {
            Self::Plain { .. } => 1.0,
            Self::BehindItself => 0.2,
            Self::BehindOther => 0.1,
            Self::Outside => 0.05,
        }
    }
}

/// Keypoints of the vehicles of a frame in both layouts. `hidden(vehicle, pixel, depth_m)` says whether something else
/// stands before a place.
pub(crate) fn of_frame(
    drive: &Drive,
    frame: usize,
    outlook: &Outlook,
    options: &KeypointOptions,
    hidden: &dyn Fn(usize, &Point2<f64>, f64) -> bool,
) -> Vec<KeypointMeasurement> {
    let mut noise = Noise::of(drive.seed, 0x6e79, frame);
    let camera = outlook.camera;
    let mut out = Vec::new();
    for sighted in &outlook.sighted {
        let Some(vehicle) = drive.vehicles.get(sighted.vehicle) else { continue };
        let box_px = sighted.whole.height();
        if box_px < options.least_height_px {
            continue;
        }
        let eye = Point3::from(sighted.pose.inverse().translation());
        for layout in LAYOUTS {
            let known = named_keypoints(layout);
            let Some(places) = vehicle.keypoints(layout) else { continue };
            let pixel = |i: usize| {
                let in_camera = sighted.pose.transform_point(places.get(i)?);
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
                    Sight::Outside
                } else if hidden(sighted.vehicle, &at, depth_m) {
                    Sight::BehindOther
                } else if facing <= VISIBLE_COSINE {
                    Sight::BehindItself
                } else {
                    plain += 1;
                    Sight::Plain { facing }
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
                let (spread, confidence) = judged(sight, box_px, &mut noise);
                let sigma = spread * (options.sigma_px + options.sigma_share * box_px);
                // A swapped keypoint is as sure of itself as a right one.
                let swapped = noise.unit() < options.swap_chance;
                let at = if swapped { pixel(keypoint.mirror).map_or(at, |p| p.0) } else { at };
                let at = Point2::new(at.x + sigma * noise.normal(), at.y + sigma * noise.normal());
                // Networks answer within the image.
                let pixel = Point2::new(
                    at.x.clamp(-0.5, f64::from(camera.width) - 0.5),
                    at.y.clamp(-0.5, f64::from(camera.height) - 0.5),
                );
                found.push(KeypointMeasurement { frame, track_id, layout, index, name, pixel, confidence });
            }
            // Of a vehicle nobody sees, nobody finds keypoints.
            if plain > 0 {
                out.extend(found);
            }
        }
    }
    out
}

/// How much wider than usual the place scatters, and how sure the network is.
fn judged(sight: Sight, box_px: f64, noise: &mut Noise) -> (f64, f64) {
    let near = (box_px / 45.0).min(1.0);
    let (spread, mean, sigma) = match sight {
        Sight::Plain { facing } => {
            // Grazing faces are narrow and hard to place.
            let open = (facing / 0.4).min(1.0);
            (1.0 + 0.8 * (1.0 - open), 0.45 + 0.28 * near + 0.15 * open, 0.06)
        }
        // Networks guess what the body hides from its symmetry: not well, and they know it.
        Sight::BehindItself => (3.0, 0.18, 0.06),
        Sight::BehindOther => (4.0, 0.12, 0.05),
        Sight::Outside => (4.0, 0.06, 0.03),
    };
    (spread, (mean + sigma * noise.normal()).clamp(0.01, 0.99))
}
