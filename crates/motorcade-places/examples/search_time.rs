//! Time and memory of extraction and search: `search_time FOLDER_OF_IMAGES [KEYFRAMES]`.
//!
//! Descriptors of the images are repeated with random bits changed until there are so many keyframes; landmarks stand at random depths, so
//! that every candidate is searched for a pose in vain, which costs most.
#![allow(clippy::print_stdout, reason = "a program")]

use std::time::Instant;

use motorcade_geometry::{PinholeCamera, Pose};
use motorcade_places::{
    Feature, FeatureExtractor, HiddenParts, Landmark, PlaceOptions, PlaceSearch, PlacedKeyframe,
};
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
        let (way_m, covariance) = (3.0 * k as f64, nalgebra::Matrix6::zeros());
        let hidden = HiddenParts::default();
        PlacedKeyframe {
            frame: k,
            segment: 0,
            world_from_camera,
            covariance,
            way_m,
            features,
            landmarks,
            hidden,
        }
    };
    let keyframes: Vec<PlacedKeyframe> = (0..count).map(|k| keyframe(k, &mut rng)).collect();
    let landmarks: usize = keyframes.iter().map(|k| k.landmarks.len()).sum();
    // Blocks of seven entries and a link.
    let index = landmarks * (36 + 32 * options.advanced.search.tables / 7);
    println!(
        "{count} keyframes, {:.0} landmarks each: {:.1} kB a keyframe, of which the index {:.1} kB; {:.0} bytes a landmark",
        landmarks as f64 / count as f64,
        (64 * landmarks + index) as f64 / count as f64 / 1e3,
        index as f64 / count as f64 / 1e3,
        (64 * landmarks + index) as f64 / landmarks as f64,
    );
    let mut search = PlaceSearch::new(camera, options);
    let last = count / 20;
    let (mut clock, mut computing) = (Instant::now(), computing_s());
    for (k, keyframe) in keyframes.into_iter().enumerate() {
        if k == count - last {
            (clock, computing) = (Instant::now(), computing_s());
        }
        search.take(keyframe, |_, _, _| true);
    }
    let each = 1e3 / last as f64;
    println!(
        "search {:.2} ms of computing, {:.2} ms on the clock a keyframe at {count} ({:?})",
        each * (computing_s() - computing),
        each * clock.elapsed().as_secs_f64(),
        search.finish().report
    );
    Ok(())
}

/// Seconds that the program has computed, where Linux reports it.
fn computing_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).map_or(f64::NAN, |ns| 1e-9 * ns)
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
