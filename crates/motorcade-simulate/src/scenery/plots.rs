//! Placement of houses, hedges, trees and lamps along both sides of the road.

use nalgebra::Point2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{buildings, plants};
use crate::drive::Drive;
use crate::mesh::{Building, Chunk};
use crate::motion::Road;
use crate::scenery::PAVEMENT_M;

/// Areas kept free: near vehicles, the camera, and the road itself.
struct Obstacles<'a> {
    road: &'a Road,
    points: Vec<(Point2<f64>, f64)>,
}

impl Obstacles<'_> {
    fn free(&self, point: &Point2<f64>, radius_m: f64) -> bool {
        let (_, d) = self.road.locate(point);
        d.abs() > self.road.half_width_m + radius_m
            && self.points.iter().all(|(p, r)| (p - point).norm() > r + radius_m)
    }
}

/// Fills both sides of the road.
pub(super) fn place(drive: &Drive, rng: &mut ChaCha8Rng, chunks: &mut Vec<Chunk>, looks: &mut Vec<Building>) {
    let road = &drive.road;
    let mut points: Vec<(Point2<f64>, f64)> = Vec::new();
    let mut add = |p: Point2<f64>, r: f64| {
        // Slow and standing vehicles repeat points.
        if points.last().is_none_or(|(last, _)| (last - p).norm() > 1.0) {
            points.push((p, r));
        }
    };
    for vehicle in &drive.vehicles {
        for pose in vehicle.poses.iter().flatten() {
            add(Point2::new(pose.translation().x, pose.translation().y), 0.5 * vehicle.size.length_m + 0.4);
        }
    }
    for pose in &drive.site_from_camera {
        add(Point2::new(pose.translation().x, pose.translation().y), 3.0);
    }
    let obstacles = Obstacles { road, points };
    let (from, to) = road.extent_m();
    for side in [-1.0, 1.0] {
        let Some(twins) = drive.staging.twins else {
            row(drive, &obstacles, side, (from, to), rng, chunks, looks);
            kerbside(&obstacles, side, (from, to), rng, chunks);
            continue;
        };
        // Both stretches are drawn from the same random numbers.
        let alike = ChaCha8Rng::seed_from_u64(rng.random());
        let ends = [twins.from_m, twins.from_m + twins.length_m];
        let again = ends.map(|s| s + twins.away_m);
        for (stretch, twin) in [
            ((from, ends[0]), false),
            ((ends[0], ends[1]), true),
            ((ends[1], again[0]), false),
            ((again[0], again[1]), true),
            ((again[1], to), false),
        ] {
            let mut own = if twin { alike.clone() } else { ChaCha8Rng::seed_from_u64(rng.random()) };
            row(drive, &obstacles, side, stretch, &mut own, chunks, looks);
            kerbside(&obstacles, side, stretch, &mut own, chunks);
        }
    }
}

/// Houses and gardens behind the pavement.
fn row(
    drive: &Drive,
    obstacles: &Obstacles<'_>,
    side: f64,
    (from, to): (f64, f64),
    rng: &mut ChaCha8Rng,
    chunks: &mut Vec<Chunk>,
    looks: &mut Vec<Building>,
) {
    let road = &drive.road;
    let back = road.half_width_m + PAVEMENT_M;
    let mut s = from;
    while s < to {
        let width = rng.random_range(7.0..17.0);
        let depth = rng.random_range(7.0..12.0);
        let setback = if rng.random_bool(0.5) { 0.3 } else { rng.random_range(1.5..6.0) };
        let seed: u64 = rng.random();
        if drive.staging.twins.is_some() && s + width > to {
            break;
        }
        let wants_house = rng.random_bool(0.72);
        let middle = s + 0.5 * width;
        let clear = road.to_crossing_m(middle) > 0.5 * width + 8.5 && !road.is_again(middle);
        let windows_m = match drive.staging.twins {
            Some(_) => (seed % 1000) as f64 * 0.37,
            None => looks.len() as f64 * 3.7,
        };
        let plot = buildings::Plot {
            s: middle,
            side,
            front_m: back + setback,
            width_m: width,
            depth_m: depth,
            windows_m,
        };
        let corners = plot.outline(road);
        let room = clear && corners.iter().all(|p| obstacles.free(p, 1.2));
        if wants_house && room {
            chunks.extend(buildings::house(road, &plot, seed, looks));
        } else if clear {
            garden(obstacles, side, s, width, back, rng, chunks);
        }
        s += width + if rng.random_bool(0.4) { rng.random_range(1.0..5.0) } else { 0.05 };
    }
}

/// A hedge or wall at the pavement and trees behind.
fn garden(
    obstacles: &Obstacles<'_>,
    side: f64,
    s: f64,
    width: f64,
    back: f64,
    rng: &mut ChaCha8Rng,
    chunks: &mut Vec<Chunk>,
) {
    let road = obstacles.road;
    let hedge = rng.random_bool(0.7);
    let height = rng.random_range(0.9..1.8);
    let ends = [s + 0.2, s + width - 0.2].map(|s| road.point(s, side * (back + 0.5)).xy());
    if hedge && ends.iter().all(|p| obstacles.free(p, 0.8)) {
        chunks.extend(plants::hedge(road, (s + 0.2, s + width - 0.2), side * (back + 0.5), height, rng));
    }
    for _ in 0..2 {
        let at = (s + rng.random_range(0.0..width), side * (back + rng.random_range(3.0..14.0)));
        let tall = rng.random_range(4.5..9.0);
        if obstacles.free(&road.point(at.0, at.1).xy(), 1.5) {
            chunks.extend(plants::tree(road, at, tall, rng));
        }
    }
}

/// Street trees and lamps on the pavement.
fn kerbside(
    obstacles: &Obstacles<'_>,
    side: f64,
    (from, to): (f64, f64),
    rng: &mut ChaCha8Rng,
    chunks: &mut Vec<Chunk>,
) {
    let road = obstacles.road;
    let d = side * (road.half_width_m + 0.75);
    let mut s = from + rng.random_range(0.0..8.0);
    while s < to {
        let point = road.point(s, d).xy();
        if road.to_crossing_m(s) > 9.0 && !road.is_again(s) && obstacles.free(&point, 0.3) {
            match rng.random_range(0..10) {
                0..4 => chunks.extend(plants::tree(road, (s, d), rng.random_range(4.0..6.5), rng)),
                4..7 => chunks.extend(plants::lamp(road, (s, d))),
                7 => chunks.extend(plants::sign(road, (s, d), rng)),
                _ => {}
            }
        }
        s += rng.random_range(6.0..13.0);
    }
}
