//! Lens of the camera that made a folder of pictures: `folder FOLDER [FIRST COUNT]`.

use motorcade_calibrate::{CalibrateOptions, Calibrator, ViewPrior};
use motorcade_odometry::StaticMask;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("a folder of pictures is needed")?;
    let first: usize = arguments.next().map_or(Ok(0), |text| text.parse())?;
    let count: usize = arguments.next().map_or(Ok(usize::MAX), |text| text.parse())?;
    let mut paths: Vec<_> = std::fs::read_dir(folder)?.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let paths = paths.iter().skip(first).take(count);
    let images =
        paths.map(|p| Ok(image::open(p)?.to_luma8())).collect::<Result<Vec<_>, image::ImageError>>()?;
    let (width, height) = images.first().ok_or("no pictures")?.dimensions();
    let mut calibrator = Calibrator::new(width, height, ViewPrior::default(), CalibrateOptions::default());
    loop {
        let mut pass = calibrator.pass();
        for (image, k) in images.iter().zip(0..) {
            pass.push(k * 100_000_000, image, &StaticMask::default());
        }
        let done = calibrator.take(pass);
        println!("{:?}", calibrator.clone().finish());
        if done {
            break;
        }
    }
    Ok(())
}
