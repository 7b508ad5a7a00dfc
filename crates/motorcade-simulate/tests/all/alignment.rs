//! Rendered road points lie at their ground truth within hundredths of a pixel, at any width.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use crate::common::{View, drive, matches, shift};
use motorcade_simulate::Renderer;

/// Largest error \[px\].
const MOST_PX: f64 = 0.02;

/// Views of a few drives, and the pairs of frames that are compared.
fn road_shift(width: u32, frames: &[(usize, usize)]) -> (f64, f64, usize) {
    let views: Vec<(View, View)> = ["straight", "empty", "parked"]
        .iter()
        .flat_map(|name| {
            let drive = drive(name, 18, width);
            let renderer = Renderer::new(&drive);
            let view = |i: usize| View::of(&drive, &renderer, i);
            frames.iter().map(|(i, j)| (view(*i), view(*j))).collect::<Vec<_>>()
        })
        .collect();
    let mut all = Vec::new();
    for (a, b) in &views {
        let near = |x: usize, y: usize| a.is_road(x, y) && (6.0..16.0).contains(&a.depth_m(x, y));
        all.extend(matches(a, b, near));
    }
    let found = shift(&all);
    (found.x, found.y, all.len())
}

#[test]
fn the_road_lies_where_its_homography_says_at_full_and_at_half_width() {
    for (width, frames) in
        [(1242, &[(4, 5), (10, 12)][..]), (621, &[(2, 3), (4, 5), (6, 8), (10, 12), (13, 16), (14, 15)][..])]
    {
        let (x, y, count) = road_shift(width, frames);
        assert!(count > 50_000, "{count} pixels at {width}");
        assert!(x.hypot(y) <= MOST_PX, "{width} px wide: off by ({x:.4}, {y:.4}) px over {count} pixels");
    }
}

#[test]
fn a_half_size_picture_is_the_full_one_halved() {
    let (full, half) = (drive("straight", 1, 1242), drive("straight", 1, 621));
    let full = View::of(&full, &Renderer::new(&full), 0);
    let half = View::of(&half, &Renderer::new(&half), 0);
    // Pixel centres lie at integers: half a pixel's square is that of four.
    let halved = full.halved(&half);
    let road = |x: usize, y: usize| half.is_road(x, y);
    let found = shift(&matches(&half, &halved, road));
    assert!(found.norm() <= MOST_PX, "road: {found}");
    let still = |x: usize, y: usize| half.depth_m(x, y) < 60.0 && half.is_still(x, y);
    let found = shift(&matches(&half, &halved, still));
    assert!(found.norm() <= MOST_PX, "everything still: {found}");
}

#[test]
fn blur_moves_nothing() {
    let sharp = drive("straight", 6, 1242);
    let sharp = View::of(&sharp, &Renderer::new(&sharp), 4);
    for samples in [3, 4] {
        let mut blurred = drive("straight", 6, 1242);
        blurred.render.sensor.blur_samples = samples;
        blurred.render.sensor.shutter_s = 0.012;
        let blurred = View::of(&blurred, &Renderer::new(&blurred), 4);
        assert_eq!(sharp.picture.depth_m, blurred.picture.depth_m);
        let near = |x: usize, y: usize| sharp.is_road(x, y) && (6.0..16.0).contains(&sharp.depth_m(x, y));
        let found = shift(&matches(&sharp, &blurred, near));
        // Half the shutter's time would be 0.7 px on average.
        assert!(found.norm() <= MOST_PX, "{samples} samples: {found}");
    }
}
