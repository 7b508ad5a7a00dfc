//! Rendering is temporally stable: no popping, no crawling textures.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use crate::common::{View, drive};
use motorcade_simulate::Renderer;

/// Side of the squares that brightness is compared over \[px\].
const SQUARE_PX: usize = 12;

/// Differences between two views.
#[derive(Debug, Default)]
struct Change {
    /// Pixels whose surface is missing in the other view: behind the point there is something farther.
    missing: usize,
    compared: usize,
    /// Per square: mean difference of grey levels, and where.
    squares: Vec<(f64, usize, usize)>,
}

/// Nearest surface about a place \[m\].
fn nearest(view: &View, x: f64, y: f64) -> f64 {
    let (x, y) = (x.round() as i64, y.round() as i64);
    let mut least = f64::INFINITY;
    for (i, j) in (x - 1..=x + 1).flat_map(|i| (y - 1..=y + 1).map(move |j| (i, j))) {
        if i >= 0 && j >= 0 && i < i64::from(view.camera.width) && j < i64::from(view.camera.height) {
            least = least.min(view.depth_m(i as usize, j as usize));
        }
    }
    least
}

fn change(a: &View, b: &View) -> Change {
    let (width, height) = (a.camera.width as usize, a.camera.height as usize);
    let mut out = Change::default();
    let columns = width.div_ceil(SQUARE_PX);
    let mut sums = vec![(0.0, 0); columns * height.div_ceil(SQUARE_PX)];
    for y in 0..height {
        for x in 0..width {
            if a.depth_m(x, y) > 300.0 || !a.is_still(x, y) {
                continue;
            }
            let Some((p, depth)) = a.carried(x, y, b) else { continue };
            if !b.camera.contains(&p, 2.0) {
                continue;
            }
            out.compared += 1;
            let there = nearest(b, p.x, p.y);
            if there > 1.04 * depth + 0.3 {
                out.missing += 1;
            }
            // Occluded there, or at a depth edge.
            let here = nearest(a, x as f64, y as f64);
            if (there - depth).abs() > 0.05 * depth || here < 0.95 * a.depth_m(x, y) {
                continue;
            }
            if let Some(level) = b.at(&p) {
                let sum = &mut sums[(y / SQUARE_PX) * columns + x / SQUARE_PX];
                *sum = (sum.0 + level - a.grey[y * width + x], sum.1 + 1);
            }
        }
    }
    for (i, (sum, count)) in sums.into_iter().enumerate() {
        if count > SQUARE_PX * SQUARE_PX / 2 {
            out.squares.push((
                sum / f64::from(count as u32),
                i % columns * SQUARE_PX,
                i / columns * SQUARE_PX,
            ));
        }
    }
    out.squares.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    out
}

#[test]
fn nothing_comes_or_goes_between_frames() {
    for (name, frames) in [("empty", [10, 30]), ("dense", [12, 33])] {
        let drive = drive(name, 35, 1242);
        let renderer = Renderer::new(&drive);
        for i in frames {
            let (a, b) = (View::of(&drive, &renderer, i), View::of(&drive, &renderer, i + 1));
            for (way, change) in [("on", change(&a, &b)), ("back", change(&b, &a))] {
                let Change { missing, compared, .. } = change;
                assert!(compared > 200_000, "{name} {i}: {compared} pixels");
                assert!(
                    missing * 20_000 < compared,
                    "{name}, frame {i} {way}: {missing} of {compared} pixels"
                );
            }
        }
    }
}

#[test]
fn no_place_changes_its_brightness_at_once() {
    // No traffic: no moving shadows.
    let drive = drive("empty", 62, 1242);
    let renderer = Renderer::new(&drive);
    for i in [10, 30, 60] {
        let (a, b) = (View::of(&drive, &renderer, i), View::of(&drive, &renderer, i + 1));
        for (way, change) in [("on", change(&a, &b)), ("back", change(&b, &a))] {
            let squares = &change.squares;
            let rms = (squares.iter().map(|s| s.0 * s.0).sum::<f64>() / squares.len() as f64).sqrt();
            assert!(squares.len() > 1500 && rms < 1.0, "frame {i} {way}: {rms} levels");
            // Edges of posts and windows make up to 9; a texture that jumps, or a house that comes, more.
            assert!(squares[0].0.abs() < 13.0, "frame {i} {way}: (levels, x, y) {:?}", squares[0]);
        }
    }
}

#[test]
fn a_jump_would_be_noticed() {
    let drive = drive("empty", 12, 1242);
    let renderer = Renderer::new(&drive);
    let (a, mut b) = (View::of(&drive, &renderer, 10), View::of(&drive, &renderer, 11));
    // A square that is brighter, and a house that is gone.
    for i in (0..80 * 80).map(|i| (240 + i / 80) * 1242 + 500 + i % 80) {
        b.grey[i] += 15.0;
    }
    for i in (0..40 * 40).map(|i| (60 + i / 40) * 1242 + 420 + i % 40) {
        b.picture.depth_m[i] = 500.0;
    }
    let change = change(&a, &b);
    assert!(change.squares[0].0.abs() > 13.0, "{:?}", change.squares[0]);
    assert!(change.missing * 20_000 > change.compared, "{} of {}", change.missing, change.compared);
}
