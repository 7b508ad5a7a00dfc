//! Frames with scenes drawn in.

use image::{Rgb, RgbImage};
use motorcade_draw::{Overlay, Scene, SceneVehicle};
use motorcade_geometry::{BoundingBox, PinholeCamera, Pose, RoadPlane};
use nalgebra::{Matrix3, Point3, Vector3};

const CAMERA: PinholeCamera =
    PinholeCamera { fx: 300.0, fy: 300.0, cx: 240.0, cy: 105.0, width: 481, height: 241 };

fn vehicle(id: u64, right: f64, ahead: f64) -> SceneVehicle {
    let rotation = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
    SceneVehicle {
        id,
        class: "Car".into(),
        hue_deg: 137 * id as u32,
        camera_from_vehicle: Pose::from_matrix(&rotation, &Vector3::new(right, 1.5, ahead)),
        size_m: [4.0, 1.8, 1.6],
        sigma_m: [0.4, 0.2],
        speed_mps: 10.0,
        moving: true,
        unsure: false,
        faint: false,
        trail_in_camera: (0..20).map(|k| Point3::new(right, 1.5, ahead - 20.0 + f64::from(k))).collect(),
    }
}

fn scene(vehicles: Vec<SceneVehicle>) -> Scene {
    let road = RoadPlane::level(1.5);
    Scene {
        number: 12,
        time_s: 1.2,
        status: None,
        speed_mps: 9.0,
        speed_sigma_mps: Some(0.3),
        road,
        vehicles,
    }
}

fn gray(value: u8) -> RgbImage {
    RgbImage::from_pixel(CAMERA.width, CAMERA.height, Rgb([value; 3]))
}

#[test]
fn the_same_scene_gives_the_same_bytes_in_any_order_of_vehicles() {
    let overlay = Overlay::new(CAMERA);
    let (a, b) = (vehicle(1, -3.0, 12.0), vehicle(2, 3.0, 18.0));
    let one = overlay.draw(&gray(120), &scene(vec![a.clone(), b.clone()]));
    assert_eq!(one.dimensions(), overlay.size());
    assert!(
        one.width().is_multiple_of(2) && one.height().is_multiple_of(2),
        "video codecs ask for even sizes"
    );
    assert!(one == overlay.draw(&gray(120), &scene(vec![b, a])));
}

#[test]
fn the_front_is_marked_and_pixels_far_from_everything_stay() {
    let overlay = Overlay::new(CAMERA);
    let frame = RgbImage::from_fn(CAMERA.width, CAMERA.height, |x, y| Rgb([x as u8, y as u8, 77]));
    let drawn = overlay.draw(&frame, &scene(vec![vehicle(1, 0.0, 14.0)]));
    // The rear is 12 m ahead, 0.9 m to both sides, on the road 1.5 m below.
    let (x, y) = (240.0 - 300.0 * 0.9 / 12.0, 105.0 + 300.0 * 1.5 / 12.0);
    assert_ne!(drawn.get_pixel(x as u32, y as u32 - 10), frame.get_pixel(x as u32, y as u32 - 10));
    for (x, y) in [(20, 10), (460, 20), (30, 100), (470, 100)] {
        assert_eq!(drawn.get_pixel(x, y), frame.get_pixel(x, y), "{x} {y}");
    }
    let seen = overlay.draw(&gray(120), &scene(vec![vehicle(1, 0.0, 14.0)]));
    let mut turned = vehicle(1, 0.0, 14.0);
    turned.camera_from_vehicle = Pose::from_parts(
        turned.camera_from_vehicle.rotation()
            * nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI),
        turned.camera_from_vehicle.translation(),
    );
    turned.trail_in_camera.clear();
    let oncoming = overlay.draw(&gray(120), &scene(vec![turned]));
    // The front is filled more strongly where it faces the camera; both are coloured.
    let tint = |image: &RgbImage| {
        let [r, g, b] = image.get_pixel(248, 125).0;
        r.abs_diff(g).max(g.abs_diff(b))
    };
    assert!(tint(&oncoming) > tint(&seen) && tint(&seen) > 0, "{} {}", tint(&oncoming), tint(&seen));
}

#[test]
fn the_grid_is_not_on_a_bonnet() {
    let bonnet = BoundingBox::new([0.0, 200.0, 481.0, 241.0]);
    let frame = gray(120);
    let below = |overlay: &Overlay| {
        let drawn = overlay.draw(&frame, &scene(Vec::new()));
        (0..481).filter(|x| drawn.get_pixel(*x, 220) != frame.get_pixel(*x, 220)).count()
    };
    let free = Overlay::new(CAMERA);
    assert!(below(&free) > 10, "{}", below(&free));
    assert_eq!(below(&free.with_fixed_regions(&[bonnet])), 0);
}

#[test]
fn anything_can_stand_in_a_scene() {
    let overlay = Overlay::new(CAMERA);
    let places = [
        (0.0, 0.0),
        (0.0, -20.0),
        (3.0, 0.5),
        (2.0, 1.0),
        (0.0, 3.0),
        (1e5, 1e-9),
        (0.0, 1e9),
        (f64::NAN, 5.0),
    ];
    let mut vehicles: Vec<SceneVehicle> =
        places.iter().enumerate().map(|(k, (x, z))| vehicle(k as u64, *x, *z)).collect();
    vehicles.push(SceneVehicle { sigma_m: [f64::INFINITY; 2], ..vehicle(20, 0.0, 9.0) });
    vehicles.push(SceneVehicle { size_m: [0.0, 1.0, 1.0], ..vehicle(21, 0.0, 9.0) });
    vehicles
        .push(SceneVehicle { class: "läßt 日本".into(), sigma_m: [80.0; 2], ..vehicle(22, 0.0, 9.0) });
    let mut all = scene(vehicles);
    all.status = Some("bridged".into());
    all.speed_mps = f64::NAN;
    let drawn = overlay.draw(&gray(0), &all);
    assert_eq!(drawn.dimensions(), overlay.draw(&gray(0), &scene(Vec::new())).dimensions());
    // A camera that looks at the sky or along its own road's normal, and a picture of another size.
    for normal in [Vector3::z(), -Vector3::z(), Vector3::y()] {
        all.road.up = normal;
        overlay.draw(&RgbImage::new(5, 700), &all);
    }
    let tiny = PinholeCamera { fx: 9.0, fy: 9.0, cx: 5.0, cy: 4.0, width: 10, height: 8 };
    Overlay::new(tiny).draw(&RgbImage::new(10, 8), &all);
}

#[test]
fn parked_vehicles_are_dashed() {
    let overlay = Overlay::new(CAMERA);
    let coloured = |moving: bool| {
        let mut vehicle = SceneVehicle { moving, ..vehicle(1, 0.0, 10.0) };
        vehicle.trail_in_camera.clear();
        let drawn = overlay.draw(&gray(120), &scene(vec![vehicle]));
        // Along the lower edge of the rear, 8 m ahead.
        let y = (105.0_f64 + 300.0 * 1.5 / 8.0).round() as u32;
        let strong = |x: &u32| {
            let [r, g, b] = drawn.get_pixel(*x, y).0;
            r.abs_diff(g).max(g.abs_diff(b)) > 60
        };
        (212..268).filter(strong).count()
    };
    let (moving, parked) = (coloured(true), coloured(false));
    assert!(moving > 50 && parked > 15 && parked < 45, "{moving} {parked}");
}
