//! A folder of images, pushed frame by frame: `cargo run --release --example images -- FOLDER FOCAL_PX HEIGHT_M FPS`.

#![allow(clippy::print_stdout, reason = "an example talks")]

use std::path::PathBuf;

use motorcade::Motorcade;
use motorcade::dataset::Frame;
use motorcade::geometry::PinholeCamera;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, focal_px, height_m, fps] = arguments.as_slice() else {
        return Err("expected FOLDER FOCAL_PX HEIGHT_M FPS".into());
    };
    let (focal_px, height_m, fps): (f64, f64, f64) = (focal_px.parse()?, height_m.parse()?, fps.parse()?);
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| entry.map(|e| e.path())).collect::<Result<_, _>>()?;
    paths.sort();

    let mut slam: Option<Motorcade> = None;
    for (k, path) in paths.iter().enumerate() {
        let image = image::open(path)?.to_rgb8();
        let (width, height) = image.dimensions();
        let camera = PinholeCamera {
            fx: focal_px,
            fy: focal_px,
            cx: 0.5 * (f64::from(width) - 1.0),
            cy: 0.5 * (f64::from(height) - 1.0),
            width,
            height,
        };
        let slam = match &mut slam {
            Some(slam) => slam,
            none => none.insert(Motorcade::builder(camera).height_m(height_m).build()?),
        };
        let now = slam.step(&Frame::from_rgb(image, (k as f64 / fps * 1e9) as i64))?;
        let position = now.ego.world_from_camera.translation();
        println!(
            "{k:5} {:8.2} {:8.2} {:8.2} m  {:5.1} m/s",
            position.x, position.y, position.z, now.speed_mps
        );
    }
    if let Some(slam) = slam {
        println!("{:.1} m driven", slam.finish().ego.length_m());
    }
    Ok(())
}
