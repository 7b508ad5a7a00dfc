//! A detector of one's own: the brightest blob of every frame is taken for a vehicle. Runs on generated images.

#![allow(clippy::print_stdout, reason = "an example talks")]

use image::{GrayImage, Luma};
use motorcade::Motorcade;
use motorcade::dataset::Frame;
use motorcade::geometry::PinholeCamera;
use motorcade::perception::{
    BoundingBox, BoxConvention, Detection, Result as PerceptionResult, VehicleClass, VehicleDetector,
};

/// Takes pixels brighter than a threshold for one car.
struct BrightCar {
    threshold: u8,
}

impl VehicleDetector for BrightCar {
    fn detect(&mut self, frame: &Frame) -> PerceptionResult<Vec<Detection>> {
        let gray = frame.gray();
        let bright = gray.enumerate_pixels().filter(|(.., p)| p.0[0] > self.threshold);
        let bbox = bright.fold(None, |bbox: Option<[f64; 4]>, (x, y, _)| {
            let (x, y) = (f64::from(x), f64::from(y));
            let [x1, y1, x2, y2] = bbox.unwrap_or([x, y, x, y]);
            Some([x1.min(x), y1.min(y), x2.max(x), y2.max(y)])
        });
        let detection = |edges| Detection {
            class: VehicleClass::Car,
            score: 0.9,
            bbox: BoundingBox::new(edges),
            convention: BoxConvention::VisibleExtent,
            external_id: None,
            pixel_size: 1.0,
            road_below: None,
        };
        Ok(bbox.map(detection).into_iter().collect())
    }

    fn description(&self) -> String {
        format!("pixels brighter than {}", self.threshold)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let camera = PinholeCamera { fx: 500.0, fy: 500.0, cx: 319.5, cy: 119.5, width: 640, height: 240 };
    let mut slam = Motorcade::builder(camera).height_m(1.5).detector(BrightCar { threshold: 200 }).build()?;
    for k in 0..8_u32 {
        // A white square that comes nearer on a grey picture.
        let mut image = GrayImage::from_pixel(640, 240, Luma([90]));
        for (x, y) in (0..40 + k).flat_map(|x| (0..30 + k).map(move |y| (300 + x, 130 + y))) {
            image.put_pixel(x, y, Luma([255]));
        }
        let now = slam.step(&Frame::from_gray(image, i64::from(k) * 100_000_000))?;
        for vehicle in &now.vehicles {
            let distance_m =
                (now.ego.world_from_camera.inverse() * vehicle.state.world_from_vehicle).translation().z;
            println!("frame {k}: vehicle {} {distance_m:.1} m ahead", vehicle.id);
        }
    }
    let drive = slam.finish();
    println!("{} vehicles over the drive", drive.vehicles.len());
    Ok(())
}
