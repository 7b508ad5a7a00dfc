//! Time and memory of extraction and search: `search_time FOLDER_OF_IMAGES [KEYFRAMES]`.
//!
//! Descriptors of the images are repeated with random bits changed until there are so many keyframes; landmarks stand at random depths, so
//! that every candidate is searched for a pose in vain, which costs most.
#![allow(clippy::print_stdout, reason = "a program")]

use std::time::Instant;

use motorcade_geometry::{PinholeCamera, Pose};
use motorcade_places::{Feature, FeatureExtractor, Landmark, PlaceOptions, PlacedKeyframe, find_places};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("search_time FOLDER_OF_IMAGES [KEYFRAMES]")?;
    let count: usize = arguments.next().map_or(Ok(10_000), |n| n.parse())?;
    let options = PlaceOptions::default();
    let mut files: Vec<_> = std::fs::read_dir(folder)?.collect::<Result<Vec<_>, _>>()?;
    files.sort_by_key(std::fs::DirEntry::file_name);
    let mut extractor = FeatureExtractor::new(options.features);
    let (mut images, mut seconds, mut size) = (Vec::new(), 0.0, (0, 0));
    for file in files.iter().step_by(5) {
        let image = image::open(file.path())?.into_luma8();
        size = image.dimensions();
        let start = Instant::now();
        images.push(extractor.extract(&image, |_, _| true));
        seconds += start.elapsed().as_secs_f64();
    }
    let features = images.iter().map(Vec::len).sum::<usize>() as f64 / images.len() as f64;
    println!(
        "extraction {:.2} ms an image of {size:?}, {features:.0} features",
        1e3 * seconds / images.len() as f64
    );

    let camera = PinholeCamera {
        fx: 720.0,
        fy: 720.0,
        cx: 0.5 * f64::from(size.0),
        cy: 0.5 * f64::from(size.1),
        width: size.0,
        height: size.1,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let keyframe = |k: usize, rng: &mut ChaCha8Rng| {
        let features: Vec<Feature> = images[k % images.len()].iter().map(|f| changed(f, rng)).collect();
        let landmarks = (0..features.len() as u32).filter(|_| rng.random_bool(0.6)).collect::<Vec<_>>();
        let landmarks = landmarks
            .into_iter()
            .map(|feature| {
                let point_in_camera =
                    [rng.random_range(-9.0..9.0), rng.random_range(-3.0..1.6), rng.random_range(5.0..40.0)];
                Landmark { feature, point_in_camera, depth_sigma: 0.05 }
            })
            .collect();
        let world_from_camera = Pose::identity();
        PlacedKeyframe { frame: k, segment: 0, world_from_camera, way_m: 3.0 * k as f64, features, landmarks }
    };
    let keyframes: Vec<PlacedKeyframe> = (0..count).map(|k| keyframe(k, &mut rng)).collect();
    let landmarks: usize = keyframes.iter().map(|k| k.landmarks.len()).sum();
    let features: usize = keyframes.iter().map(|k| k.features.len()).sum();
    let index = landmarks * (36 + 4 * options.search.tables);
    println!(
        "{count} keyframes, {:.0} landmarks each: {:.1} kB a keyframe, of which the index {:.1} kB; {:.0} bytes a landmark",
        landmarks as f64 / count as f64,
        (44 * features + 20 * landmarks + index) as f64 / count as f64 / 1e3,
        index as f64 / count as f64 / 1e3,
        (44 * features + 20 * landmarks + index) as f64 / landmarks as f64,
    );
    let time = |keyframes: &[PlacedKeyframe]| {
        let start = Instant::now();
        let report = find_places(&camera, keyframes, |_| true, &options).1;
        (start.elapsed().as_secs_f64(), report)
    };
    let last = count / 20;
    let (short, long) = (time(&keyframes[..count - last]), time(&keyframes));
    println!("search {:.2} ms a keyframe at {count} ({:?})", 1e3 * (long.0 - short.0) / last as f64, long.1);
    Ok(())
}

/// The feature with twenty of its bits changed.
fn changed(feature: &Feature, rng: &mut ChaCha8Rng) -> Feature {
    let mut out = *feature;
    for _ in 0..20 {
        let bit = rng.random_range(0..256);
        out.descriptor.0[bit / 64] ^= 1 << (bit % 64);
    }
    out
}
