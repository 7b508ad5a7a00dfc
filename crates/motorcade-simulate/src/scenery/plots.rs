//! Placement of houses, hedges, trees and lamps along both sides of the road.

use nalgebra::Point2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{buildings, plants};
use crate::drive::Drive;
use crate::mesh::{Building, Chunk};
use crate::motion::{Paved, Road, RoadKind};
use crate::scenery::PAVEMENT_M;

/// Distance of the two hedges of a median from its middle \[m\].
const MEDIAN_HEDGE_M: f64 = 0.02;

/// Areas kept free: near vehicles, the camera, and the road itself.
struct Obstacles<'a> {
    road: &'a Road,
    points: Vec<(Point2<f64>, f64)>,
}

impl Obstacles<'_> {
    fn free(&self, point: &Point2<f64>, radius_m: f64) -> bool {
        let (s, d) = self.road.locate(point);
        d.abs() > self.road.half_width_m + radius_m
            && self.road.to_paving_m(s, d) > radius_m
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
    for island in road.paved.iter().filter(|p| p.island_m > 0.0) {
        plant(road, island, rng, chunks);
    }
    if road.kind == RoadKind::Motorway {
        for half in [-MEDIAN_HEDGE_M, MEDIAN_HEDGE_M] {
            chunks.extend(plants::hedge(road, (from, to), half, 0.9, rng));
        }
    }
    for side in [-1.0, 1.0] {
        let Some(twins) = drive.staging.twins else {
            let back_m = road.half_width_m + PAVEMENT_M;
            row(drive, &obstacles, (side, back_m), (from, to), rng, chunks, looks);
            behind(drive, &obstacles, side, rng, chunks, looks);
            if road.kind == RoadKind::Street {
                kerbside(&obstacles, side, (from, to), rng, chunks);
            }
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
            let back_m = road.half_width_m + PAVEMENT_M;
            row(drive, &obstacles, (side, back_m), stretch, &mut own, chunks, looks);
            kerbside(&obstacles, side, stretch, &mut own, chunks);
        }
    }
}

/// Further rows of houses where traffic leaves the road: it would else come out of the town.
fn behind(
    drive: &Drive,
    obstacles: &Obstacles<'_>,
    side: f64,
    rng: &mut ChaCha8Rng,
    chunks: &mut Vec<Chunk>,
    looks: &mut Vec<Building>,
) {
    const ROWS: u32 = 6;
    const PITCH_M: f64 = 17.0;
    const ALONG_M: f64 = 70.0;
    let road = &drive.road;
    let extents = road.paved.iter().map(Paved::extent_m);
    let Some((from, to)) = extents.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else { return };
    let (first, last) = road.extent_m();
    let stretch = ((from - ALONG_M).max(first), (to + ALONG_M).min(last));
    for k in 1..=ROWS {
        let back_m = road.half_width_m + PAVEMENT_M + PITCH_M * f64::from(k);
        row(drive, obstacles, (side, back_m), stretch, rng, chunks, looks);
    }
}

/// Bushes round the edge of an island.
fn plant(road: &Road, island: &Paved, rng: &mut ChaCha8Rng, chunks: &mut Vec<Chunk>) {
    const BUSHES: u32 = 14;
    let [s, d] = island.ends_m[0];
    for i in 0..BUSHES {
        let (sin, cos) = (f64::from(i) / f64::from(BUSHES) * std::f64::consts::TAU).sin_cos();
        let out_m = island.island_m - 2.0;
        chunks.extend(plants::bush(road, (s + out_m * cos, d + out_m * sin), 0.8, rng));
    }
}

/// Houses and gardens behind the pavement, or farther from the road: `back_m` from its centre line.
fn row(
    drive: &Drive,
    obstacles: &Obstacles<'_>,
    (side, back): (f64, f64),
    (from, to): (f64, f64),
    rng: &mut ChaCha8Rng,
    chunks: &mut Vec<Chunk>,
    looks: &mut Vec<Building>,
) {
    let road = &drive.road;
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
        let room = clear && road.kind == RoadKind::Street && corners.iter().all(|p| obstacles.free(p, 1.2));
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
    let off_paving = (0..=8).all(|k| road.to_paving_m(s + width * f64::from(k) / 8.0, side * back) > 1.5);
    if hedge && off_paving && ends.iter().all(|p| obstacles.free(p, 0.8)) {
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
