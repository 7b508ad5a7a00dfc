//! One labelled crop of one vehicle.

use motorcade_geometry::{Camera, PinholeCamera, Pose, Vehicle};
use motorcade_perception::BoundingBox;
use motorcade_shape::{Layout, VISIBLE_COSINE};
use nalgebra::{Point2, Point3, Vector3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::sensor;
use super::street::{Street, View};
use crate::form::named_keypoints;
use crate::render::{Renderer, projected};

/// Keypoints of a crop.
pub(super) const KEYPOINTS: usize = 36;
/// Side of the low-resolution rendering that finds the visible part \[px\].
const SURVEY_PX: u32 = 72;
/// Least height and width of a box in the picture \[px\], and share of the vehicle's extent inside the picture.
const LEAST_PX: (f64, f64) = (16.0, 10.0);
const LEAST_INSIDE: f64 = 0.12;
/// Least visible share of the vehicle.
const LEAST_SEEN: f64 = 0.2;

/// Visibility of a keypoint in a crop; stored as its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Visibility {
    /// Visible.
    Visible = 0,
    /// On a side of the vehicle that faces away.
    SelfOccluded = 1,
    /// Occluded by another object.
    Occluded = 2,
    /// Outside the picture.
    Outside = 3,
    /// The vehicle has no keypoints.
    Unknown = 4,
}

/// Columns of the numbers of a crop.
pub(super) const COLUMNS: [&str; 25] = [
    "box_x1_px",
    "box_y1_px",
    "box_x2_px",
    "box_y2_px", // in the crop, edges
    "picture_x1_px",
    "picture_y1_px",
    "picture_x2_px",
    "picture_y2_px", // edges of the picture, in the crop
    "px_per_crop_x",
    "px_per_crop_y", // pixels of the picture a pixel of the crop spans
    "focal_px",
    "heading_rad",
    "depth_m", // along the optical axis
    "length_m",
    "width_m",
    "height_m",
    "body",
    "seen_share",
    "inside_share",
    "box_is_visible_part",
    "centre_x_px",
    "centre_y_px", // of the vehicle's box in 3D, in the crop
    "camera_height_m",
    "street",
    "view",
];

/// A crop with its labels.
#[derive(Clone, Debug)]
pub(super) struct Crop {
    /// RGB, row by row.
    pub pixels: Vec<u8>,
    /// In the crop \[px\], pixel centres at integers.
    pub keypoints: [[f32; 2]; KEYPOINTS],
    pub sights: [u8; KEYPOINTS],
    pub numbers: [f32; COLUMNS.len()],
}

/// Size of crops.
#[derive(Clone, Copy, Debug)]
pub(super) struct CropShape {
    /// Side \[px\].
    pub side: u32,
    /// Size of the crop relative to the box.
    pub margin: f64,
}

/// A rectangle of the picture at another resolution.
struct Part {
    corner: [f64; 2],
    /// Pixels of the part per pixel of the picture.
    scale: [f64; 2],
    camera: PinholeCamera,
}

impl Part {
    /// `edges` are x1, y1, x2, y2 \[px\]; pixel centres lie at integers, so that a picture's left edge is at −0.5.
    fn of(camera: &PinholeCamera, edges: [f64; 4], side: u32) -> Self {
        let [x1, y1, x2, y2] = edges;
        let scale = [f64::from(side) / (x2 - x1), f64::from(side) / (y2 - y1)];
        let camera = PinholeCamera {
            fx: camera.fx * scale[0],
            fy: camera.fy * scale[1],
            cx: (camera.cx - x1) * scale[0] - 0.5,
            cy: (camera.cy - y1) * scale[1] - 0.5,
            width: side,
            height: side,
        };
        Self { corner: [x1, y1], scale, camera }
    }
    fn x(&self, x: f64) -> f64 {
        (x - self.corner[0]) * self.scale[0] - 0.5
    }
    fn y(&self, y: f64) -> f64 {
        (y - self.corner[1]) * self.scale[1] - 0.5
    }
    fn back(&self, [x1, y1, x2, y2]: [f64; 4]) -> [f64; 4] {
        let x = |v: f64| (v + 0.5) / self.scale[0] + self.corner[0];
        let y = |v: f64| (v + 0.5) / self.scale[1] + self.corner[1];
        [x(x1), y(y1), x(x2), y(y2)]
    }
    fn place(&self, [x1, y1, x2, y2]: [f64; 4]) -> [f64; 4] {
        [self.x(x1), self.y(y1), self.x(x2), self.y(y2)]
    }
}

/// The box scaled about its middle.
fn grown([x1, y1, x2, y2]: [f64; 4], factor: f64) -> [f64; 4] {
    let (cx, cy) = (0.5 * (x1 + x2), 0.5 * (y1 + y2));
    let (w, h) = (0.5 * factor * (x2 - x1), 0.5 * factor * (y2 - y1));
    [cx - w, cy - h, cx + w, cy + h]
}

fn common(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])]
}

fn large_enough(edges: [f64; 4]) -> bool {
    edges[3] - edges[1] >= LEAST_PX.1.max(LEAST_PX.0) && edges[2] - edges[0] >= LEAST_PX.1
}

/// Renders the target of view `index`; `None` when too little of it is visible.
pub(super) fn render(
    renderer: &Renderer<'_>,
    street: &Street,
    (number, index): (u64, usize),
    shape: CropShape,
    rng: &mut ChaCha8Rng,
) -> Option<Crop> {
    let View { target, camera } = street.views.get(index)?;
    let pose = street.drive.camera_from_vehicle(*target, index)?;
    let whole = projected(camera, renderer.vehicle_mesh(*target)?, &pose)?;
    let picture = [-0.5, -0.5, f64::from(camera.width) - 0.5, f64::from(camera.height) - 0.5];
    let inside = common(whole, picture);
    let inside_share = BoundingBox::new(inside).area() / BoundingBox::new(whole).area().max(1e-6);
    if !large_enough(inside) || inside_share < LEAST_INSIDE {
        return None;
    }
    let survey = Part::of(camera, grown(inside, 1.05), SURVEY_PX);
    let seen = renderer.visible_extent(index, &survey.camera, *target, survey.place(picture))?;
    let seen = common(survey.back(seen), inside);
    // Detectors draw some boxes around the visible part and some around the whole.
    let visible_part = rng.random_bool(0.5);
    let edges = if visible_part { seen } else { inside };
    if !large_enough(edges) {
        return None;
    }
    let part = Part::of(camera, grown(edges, shape.margin), shape.side);
    let window = renderer.window(index, &part.camera)?;
    let seen_share = window.picture.views.get(*target)?.visible_share();
    if seen_share < LEAST_SEEN {
        return None;
    }

    let vehicle = street.drive.vehicles.get(*target)?;
    let mut keypoints = [[0.0_f32; 2]; KEYPOINTS];
    let mut sights = [Visibility::Unknown as u8; KEYPOINTS];
    if let Some(places) = vehicle.keypoints(Layout::Car36) {
        let eye = Point3::from(pose.inverse().translation());
        let known = named_keypoints(Layout::Car36);
        for (i, (place, keypoint)) in places.iter().zip(known).enumerate().take(KEYPOINTS) {
            let in_camera = pose.transform_point(place);
            let Some(pixel) = camera.project(&in_camera) else { continue };
            let in_crop = Point2::new(part.x(pixel.x), part.y(pixel.y));
            keypoints[i] = [in_crop.x as f32, in_crop.y as f32];
            let outside =
                pixel.x < picture[0] || pixel.y < picture[1] || pixel.x > picture[2] || pixel.y > picture[3];
            let to_eye = eye - place;
            let facing = |f: &Vector3<f64>| f.dot(&to_eye) / to_eye.norm().max(1e-9);
            let sight = if outside {
                Visibility::Outside
            } else if !keypoint.faces.iter().any(|f| facing(f) > VISIBLE_COSINE) {
                Visibility::SelfOccluded
            } else if hidden(&window.picture, shape.side, &in_crop, in_camera.z, *target) {
                Visibility::Occluded
            } else {
                Visibility::Visible
            };
            sights[i] = sight as u8;
        }
    }
    let size = &vehicle.size;
    let middle = pose.transform_point(&Point3::new(0.0, 0.0, 0.5 * size.height_m));
    let centre = camera.project(&middle)?;
    let [box_x1, box_y1, box_x2, box_y2] = part.place(edges);
    let [picture_x1, picture_y1, picture_x2, picture_y2] = part.place(picture);
    let camera_height_m = {
        let at = street.drive.site_from_camera.get(index)?.translation();
        at.z - street.drive.road.surface(&Point2::new(at.x, at.y)).0
    };
    let numbers = [
        box_x1,
        box_y1,
        box_x2,
        box_y2,
        picture_x1,
        picture_y1,
        picture_x2,
        picture_y2,
        1.0 / part.scale[0],
        1.0 / part.scale[1],
        camera.fx,
        heading_to_ray(camera, &pose, 0.5 * (edges[0] + edges[2])),
        middle.z,
        size.length_m,
        size.width_m,
        size.height_m,
        *street.labels.get(*target)? as f64,
        seen_share,
        inside_share,
        f64::from(u8::from(visible_part)),
        part.x(centre.x),
        part.y(centre.y),
        camera_height_m,
        number as f64,
        index as f64,
    ]
    .map(|v| v as f32);
    let true_size = (shape.margin * (edges[2] - edges[0]), shape.margin * (edges[3] - edges[1]));
    let pixels = sensor::expose(&window.light, shape.side as usize, true_size, rng);
    Some(Crop { pixels, keypoints, sights, numbers })
}

/// Heading relative to the ray through a column of the picture: 0 drives straight away along the ray, positive turns to the
/// left, in (−π, π].
fn heading_to_ray(camera: &PinholeCamera, pose: &Pose<Camera, Vehicle>, column: f64) -> f64 {
    let forward = pose.transform_vector(&Vector3::x());
    let heading = (-forward.x).atan2(forward.z);
    let ray = (-(column - camera.cx) / camera.fx).atan();
    let turn = heading - ray;
    turn.sin().atan2(turn.cos())
}

/// True when something other than the vehicle occludes a point.
fn hidden(
    picture: &crate::render::Picture,
    side: u32,
    at: &Point2<f64>,
    depth_m: f64,
    target: usize,
) -> bool {
    let (x, y) = (at.x.round(), at.y.round());
    let last = f64::from(side) - 1.0;
    // Outside the crop occlusion is unknown; a box around the visible part excludes only occluded points.
    if x < 0.0 || y < 0.0 || x > last || y > last {
        return true;
    }
    let (x, y) = (x as u32, y as u32);
    let owner = picture.instance.get_pixel(x, y).0[0];
    let nearest = picture.depth_m.get((y * side + x) as usize).copied().unwrap_or(f32::INFINITY);
    usize::from(owner) != target + 1 && f64::from(nearest) < depth_m - 0.15
}
