//! Rendered images agree with their ground truth.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use image::GrayImage;
use motorcade_dataset::gray_from_rgb;
use motorcade_perception::{BoundingBox, BoxConvention};
use motorcade_simulate::{Drive, Picture, RenderOptions, Renderer, Scenario, Weather, simulate};
use motorcade_vehicles::image_box;
use nalgebra::{Point2, Point3};

fn drive(name: &str, frames: usize, width: u32) -> Drive {
    let mut options = RenderOptions::default().with_width(width);
    options.sensor.noise = 0.0;
    options.sensor.exposure_drift = 0.0;
    simulate(&Scenario::by_name(name).unwrap(), frames, 11, &options).unwrap()
}

fn picture(drive: &Drive, frame: usize) -> Picture {
    Renderer::new(drive).render(frame).unwrap()
}

#[test]
fn one_thread_and_two_give_the_same_bytes() {
    let mut drive = drive("dense", 2, 200);
    drive.render.sensor.noise = 2.0;
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| picture(&drive, 1))
    };
    let (one, two) = (with(1), with(2));
    assert_eq!(one, two);
    assert_ne!(one.rgb, picture(&drive, 0).rgb);
}

#[test]
fn boxes_agree_with_the_instance_map_and_with_the_outline_the_pipeline_uses() {
    let drive = drive("demo", 41, 621);
    let picture = picture(&drive, 40);
    let camera = drive.camera();
    let mut compared = 0;
    for (i, view) in picture.views.iter().enumerate() {
        let Some(seen) = view.visible_px else { continue };
        let whole = BoundingBox::new(seen);
        let free =
            [whole.x1, whole.y1, f64::from(camera.width) - whole.x2, f64::from(camera.height) - whole.y2];
        if view.visible_share() < 0.999 || free.iter().any(|m| *m < 2.0) || whole.height() < 12.0 {
            continue;
        }
        compared += 1;
        // The map has whole pixels: its extent is the same within one.
        let mine: Vec<(u32, u32)> = picture
            .instance
            .enumerate_pixels()
            .filter(|p| usize::from(p.2.0[0]) == i + 1)
            .map(|p| (p.0, p.1))
            .collect();
        let left = f64::from(mine.iter().map(|p| p.0).min().unwrap());
        let bottom = f64::from(mine.iter().map(|p| p.1).max().unwrap());
        assert!((left - seen[0]).abs() < 1.3 && (bottom - seen[3]).abs() < 1.3);
        let vehicle = &drive.vehicles[i];
        let pose = drive.camera_from_vehicle(i, 40).unwrap();
        let outline =
            image_box(&camera, &pose, vehicle.class, BoxConvention::VisibleExtent, &vehicle.size).unwrap();
        assert!(outline.iou(&whole) > 0.85, "vehicle {i}: outline {outline:?}, mesh {whole:?}");
    }
    assert!(compared >= 2, "{compared} vehicles in full view");
}

#[test]
fn paved_ground_beside_the_road_is_carriageway_and_its_islands_are_not() {
    let drive = drive("roundabout-exits", 61, 414);
    let (picture, camera) = (picture(&drive, 60), drive.camera());
    let (mut ring, mut mixed, mut island) = (0, 0, 0);
    for (x, y, share) in picture.road.enumerate_pixels() {
        let depth_m = f64::from(picture.depth_m[(y * camera.width + x) as usize]);
        if picture.instance.get_pixel(x, y).0[0] > 0 || !depth_m.is_finite() {
            continue;
        }
        let ray = camera.ray(&Point2::new(f64::from(x), f64::from(y)));
        let point = drive.site_from_camera[60].transform_point(&Point3::from(ray * depth_m));
        // The road is the x axis, the centre of the roundabout 40 m along it; bushes are higher.
        let from_centre = (point.x - 40.0).hypot(point.y);
        if point.z.abs() < 0.03 && (11.0..17.0).contains(&from_centre) {
            ring += 1;
            // Pixels on the edges of trunks and wheels are mixed.
            mixed += usize::from(share.0[0] < 250);
        } else if point.z.abs() < 0.03 && from_centre < 8.0 {
            island += 1;
            assert_eq!(share.0[0], 0, "({x}, {y}) at {point}");
        }
    }
    assert!(ring > 500 && 50 * mixed < ring && island > 50, "{ring}, {mixed} and {island} pixels");
}

/// Bilinear grey level.
fn level(image: &GrayImage, x: f64, y: f64) -> Option<f64> {
    let (i, j) = (x.floor(), y.floor());
    if i < 0.0 || j < 0.0 || i + 1.0 >= f64::from(image.width()) || j + 1.0 >= f64::from(image.height()) {
        return None;
    }
    let (fx, fy) = (x - i, y - j);
    let at = |dx: u32, dy: u32| f64::from(image.get_pixel(i as u32 + dx, j as u32 + dy).0[0]);
    let top = at(0, 0) * (1.0 - fx) + at(1, 0) * fx;
    let bottom = at(0, 1) * (1.0 - fx) + at(1, 1) * fx;
    Some(top * (1.0 - fy) + bottom * fy)
}

#[test]
fn depth_and_pose_carry_one_picture_into_the_next() {
    let drive = drive("straight", 3, 621);
    let (first, second) = (picture(&drive, 0), picture(&drive, 1));
    let (a, b) = (gray_from_rgb(&first.rgb), gray_from_rgb(&second.rgb));
    let second_from_first = drive.site_from_camera[1].inverse() * drive.site_from_camera[0];
    let camera = drive.camera();
    // Mean difference of grey levels over road and houses when the place in the second picture is off by so much.
    let difference = |off_x: f64, off_y: f64| {
        let (mut sum, mut count) = (0.0, 0.0);
        for (i, depth) in first.depth_m.iter().enumerate() {
            let (x, y) = (i as u32 % camera.width, i as u32 / camera.width);
            if first.instance.get_pixel(x, y).0[0] > 0 || *depth > 35.0 {
                continue;
            }
            let point =
                Point3::from(camera.ray(&Point2::new(f64::from(x), f64::from(y))) * f64::from(*depth));
            let Some(p) = camera.project(&second_from_first.transform_point(&point)) else { continue };
            if let Some(found) = level(&b, p.x + off_x, p.y + off_y) {
                sum += (found - f64::from(a.get_pixel(x, y).0[0])).abs();
                count += 1.0;
            }
        }
        sum / f64::max(count, 1.0)
    };
    let right = difference(0.0, 0.0);
    assert!(right < 4.0, "{right} grey levels");
    for (x, y) in [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)] {
        assert!(difference(x, y) > 1.05 * right, "half a pixel off by ({x}, {y}) is no worse than none");
    }
}

#[test]
fn the_road_has_texture_near_and_far() {
    let drive = drive("straight", 1, 1242);
    let picture = picture(&drive, 0);
    let grey = gray_from_rgb(&picture.rgb);
    for (rows, range) in [(300..370, "6 to 9 m"), (205..230, "21 to 37 m")] {
        let (mut strong, mut all) = (0, 0);
        for y in rows {
            for x in 400..820 {
                if picture.road.get_pixel(x, y).0[0] < 255 || picture.instance.get_pixel(x, y).0[0] > 0 {
                    continue;
                }
                let at = |x: u32, y: u32| f64::from(grey.get_pixel(x, y).0[0]);
                let gradient = (at(x + 2, y) - at(x - 2, y)).hypot(at(x, y + 2) - at(x, y - 2));
                strong += usize::from(gradient > 6.0);
                all += 1;
            }
        }
        assert!(strong * 5 > all && all > 1000, "{range}: {strong} of {all} pixels have a gradient");
    }
}

#[test]
fn rain_is_darker_and_flatter_than_sun_and_still_has_texture() {
    let seen = |weather: Weather| {
        let mut drive = drive("demo", 1, 414);
        drive.render.weather = weather;
        let grey = gray_from_rgb(&picture(&drive, 0).rgb);
        let n = grey.as_raw().len() as f64;
        let mean = grey.as_raw().iter().map(|v| f64::from(*v)).sum::<f64>() / n;
        let spread = grey.as_raw().iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / n;
        (mean, spread.sqrt())
    };
    let (clear, overcast, rain) = (seen(Weather::Clear), seen(Weather::Overcast), seen(Weather::Rain));
    assert!(rain.0 < 0.8 * overcast.0 && rain.1 < 0.9 * clear.1, "{clear:?} {overcast:?} {rain:?}");
    assert!(rain.1 > 10.0, "{rain:?}");
    assert_ne!(clear, overcast);
    let (night, low_sun) = (seen(Weather::Night), seen(Weather::LowSun));
    assert!(night.0 < 0.3 * overcast.0 && low_sun.0 > 1.2 * clear.0, "{night:?} {low_sun:?}");
}

/// Above a level road a pixel of the road shows what stands as far above it, upside down.
#[test]
fn a_wet_road_mirrors_the_houses() {
    let mut drive = drive("straight", 1, 414);
    drive.render.sensor.noise = 0.0;
    drive.render.weather = Weather::Overcast;
    let dry = picture(&drive, 0);
    drive.render.weather = Weather::WetMirror;
    let wet = picture(&drive, 0);
    let (mut changed, mut all) = (0, 0);
    for (x, y, share) in wet.road.enumerate_pixels() {
        let difference = |k: usize| dry.rgb.get_pixel(x, y).0[k].abs_diff(wet.rgb.get_pixel(x, y).0[k]);
        let differs = (0..3).any(|k| difference(k) > 3);
        match share.0[0] {
            0 => assert!(!differs, "{x}, {y} is no road"),
            255 => (changed, all) = (changed + usize::from(differs), all + 1),
            _ => {}
        }
    }
    assert!(10 * changed > 9 * all && all > 5000, "{changed} of {all}");
}
