//! The ground: carriageway with markings, patches, cracks and manholes, kerb stones, pavement, verge.

use super::colour::{Colour, mixed, scaled};
use super::coverage::{cover, cover_periodic};
use super::scene::{Fragment, Scene};
use super::tile::{Probe, floor};
use crate::hash;
use crate::motion::{CROSSING_HALF_WIDTH_M, Road, RoadKind};
use crate::scenery::{KERB_M, PAVEMENT_M};

/// Half width of a median \[m\].
const MEDIAN_HALF_M: f32 = 1.5;
/// Solid lines of a motorway, at the median and at the hard shoulder, from its middle \[m\].
const MOTORWAY_EDGES_M: [f32; 2] = [2.0, 13.25];
/// Lines between its lanes \[m\].
const MOTORWAY_LANES_M: [f32; 2] = [5.75, 9.5];
/// Width of a kerb stone \[m\].
const KERB_STONE_M: f32 = 0.16;

/// Colour and share of carriageway at (s, d).
pub(super) fn colour(scene: &Scene<'_>, f: &Fragment) -> (Colour, f32) {
    let road = &scene.drive.road;
    let [s, d, h] = f.place();
    let print = f.footprint(0, 1);
    let [fs, fd] = print.extent();
    let probe = print.probe();
    let noise = &scene.textures.noise;
    // Two incommensurable periods hide the repetition.
    let fine = noise.sample(s, d, &probe, 5.3);
    let coarse = noise.sample(0.8 * s + 0.6 * d, 0.8 * d - 0.6 * s, &probe.turned(0.8, 0.6), 43.0);

    let half = road.half_width_m as f32;
    let on_crossing: f32 = road
        .crossings_m
        .iter()
        .map(|c| {
            let (c, w) = (*c as f32, CROSSING_HALF_WIDTH_M as f32);
            cover(s, c - w, c + w, fs)
        })
        .sum();
    let street = cover(d, -half, half, fd).max(on_crossing);
    let standing_up = f.normal.z < 0.5;
    let street = if standing_up { 0.0 } else { street };
    let (paved, bare) = (paved(road, [s, d], fs.max(fd)), unpaved(road, [s, d], [fs, fd]));
    let street = street.max(paved) * (1.0 - bare);

    let mut colour = [0.0; 3];
    if street > 0.0 {
        let extent = [fs, fd];
        let point = GroundPoint { s, d, extent, probe: &probe, fine, coarse, on_crossing, on_paving: paved };
        colour = scaled(asphalt(scene, &point), street);
    }
    if street < 1.0 {
        let stones = half + KERB_STONE_M;
        let edge = half + PAVEMENT_M as f32;
        let across = d.abs();
        // Height does not tell kerbs from verges on ground that is level as a whole.
        let level = road.kind == RoadKind::Motorway || !road.paved.is_empty() && !standing_up;
        let kerb = if level || h >= KERB_M as f32 * 0.95 { cover(across, 0.0, stones, fd) } else { 1.0 };
        let kerb = if road.kind == RoadKind::Motorway { 0.0 } else { kerb * (1.0 - bare) };
        let pavement = match road.kind {
            RoadKind::Street => cover(across, stones, edge, fd) * (1.0 - kerb) * (1.0 - bare),
            RoadKind::Motorway => 0.0,
        };
        let verge = (1.0 - kerb - pavement).max(0.0);
        let mut off = [0.0; 3];
        if kerb > 0.0 {
            let joint = cover_periodic(s, 0.0, 0.02, 1.0, fs);
            let tone = 1.0 + 0.16 * fine + 0.12 * coarse - 0.4 * joint;
            off = added(off, [0.60, 0.60, 0.58], kerb * tone);
        }
        if pavement > 0.0 {
            let joints = cover_periodic(s, 0.0, 0.015, 0.6, fs).max(cover_periodic(d, 0.0, 0.015, 0.6, fd));
            let near = (1.0 - fs.max(fd) / 0.6).clamp(0.0, 1.0);
            let slab = (hash::unit(7, floor(s / 0.6) as i64, floor(d / 0.6) as i64) - 0.5) * near;
            let tone = 1.0 + 0.16 * fine + 0.15 * coarse + 0.25 * slab - 0.35 * joints;
            off = added(off, [0.52, 0.50, 0.47], pavement * tone);
        }
        if verge > 0.0 {
            let grass = mixed([0.30, 0.37, 0.17], [0.42, 0.38, 0.26], (0.5 + 0.9 * coarse).clamp(0.0, 1.0));
            off = added(off, grass, verge * (1.0 + 0.4 * fine + 0.25 * coarse));
        }
        colour = added(colour, off, 1.0 - street);
    }
    (colour, street)
}

/// Share of paved ground beside the carriageway.
fn paved(road: &Road, [s, d]: [f32; 2], extent: f32) -> f32 {
    if road.paved.is_empty() {
        return 0.0;
    }
    cover(road.to_paving_m(f64::from(s), f64::from(d)) as f32, -1e6, 0.0, extent)
}

/// Share of islands and of the median.
fn unpaved(road: &Road, [s, d]: [f32; 2], [fs, fd]: [f32; 2]) -> f32 {
    let median = match road.kind {
        RoadKind::Street => 0.0,
        RoadKind::Motorway => cover(d, -MEDIAN_HALF_M, MEDIAN_HALF_M, fd),
    };
    let off = road.paved.iter().filter_map(|p| p.off_island_m(f64::from(s), f64::from(d)));
    off.map(|off| cover(off as f32, -1e6, 0.0, fs.max(fd))).fold(median, f32::max)
}

/// Share of paint on a motorway: edges of the carriageway solid, of the lanes dashed.
fn motorway_paint(s: f32, d: f32, [fs, fd]: [f32; 2]) -> f32 {
    let line = |at: f32, half: f32| cover(d.abs(), at - half, at + half, fd);
    let solid = line(MOTORWAY_EDGES_M[0], 0.1) + line(MOTORWAY_EDGES_M[1], 0.1);
    let dashed = line(MOTORWAY_LANES_M[0], 0.075) + line(MOTORWAY_LANES_M[1], 0.075);
    solid + dashed * cover_periodic(s, 0.0, 6.0, 18.0, fs)
}

/// Share of the dashed middle lines of paved streets.
fn middle_lines(road: &Road, [s, d]: [f32; 2], [fs, fd]: [f32; 2]) -> f32 {
    let one = |p: &crate::motion::Paved| {
        let (along, across) = p.local(f64::from(s), f64::from(d));
        let inside = cover(along as f32, 3.0, p.length_m() as f32, fs.max(fd));
        let extent = fs.max(fd);
        inside
            * cover(across as f32, -0.07, 0.07, extent)
            * cover_periodic(along as f32, 0.0, 3.0, 7.0, extent)
    };
    road.paved.iter().filter(|p| p.centre_line).map(one).sum()
}

/// Mix of a and b with a share of b.
fn added(a: Colour, b: Colour, share: f32) -> Colour {
    [a[0] + b[0] * share, a[1] + b[1] * share, a[2] + b[2] * share]
}
/// A pixel's position on the carriageway, its footprint and texture values.
struct GroundPoint<'a> {
    s: f32,
    d: f32,
    /// Footprint of the pixel along and across \[m\].
    extent: [f32; 2],
    probe: &'a Probe,
    fine: f32,
    coarse: f32,
    on_crossing: f32,
    on_paving: f32,
}

fn asphalt(scene: &Scene<'_>, point: &GroundPoint<'_>) -> Colour {
    let &GroundPoint { s, d, extent: [fs, fd], probe, fine, coarse, on_crossing, on_paving } = point;
    let half = scene.drive.road.half_width_m as f32;
    // Cracks are thinner than far pixels: they fade out and are skipped there.
    let near = (1.2 - 4.0 * fs.min(fd).max(0.25 * fs.max(fd))).clamp(0.0, 1.0);
    let cracks = if near > 0.0 { near * scene.textures.cracks.sample(s, d, probe, 17.0) } else { 0.0 };
    let mut grey = 0.36 + 0.075 * fine + 0.05 * coarse + 0.12 * cracks;
    // Wheel tracks are slightly darker.
    let lane = (d.abs() - 1.75).abs();
    grey -= 0.025 * (1.0 - ((lane - 0.75) / 0.35).powi(2)).max(0.0);
    for patch in scene.repairs.patches_at(s) {
        let (middle, wide) = (patch.middle_m, patch.half_width_m);
        let inside = cover(s, patch.from_m, patch.to_m, fs) * cover(d, middle - wide, middle + wide, fd);
        let rim = cover(s, patch.from_m - 0.05, patch.to_m + 0.05, fs)
            * cover(d, middle - wide - 0.05, middle + wide + 0.05, fd);
        grey += patch.tone * inside - 0.12 * (rim - inside);
    }
    if let Some([ms, md]) = scene.repairs.manhole_at(s) {
        let squared = (s - ms).powi(2) + (d - md).powi(2);
        let soft = fs.min(2.0).max(fd);
        // Nothing beyond its rim.
        if squared < (0.33 + soft).powi(2) {
            let radius = squared.sqrt();
            grey -= 0.16
                * cover(radius, -0.33, 0.33, soft)
                * (1.0 - 0.35 * cover(radius, 0.14, 0.24, fs.max(fd)));
        }
    }
    let mut colour = [grey, grey, grey * 1.02];

    // Paint, worn by the noise.
    // The distance to a crossing is infinite on a road without crossings: clamped to a finite one.
    let clear = scene.drive.road.to_crossing_m(f64::from(s)).min(1e5) as f32;
    let road = &scene.drive.road;
    let mut paint = 0.0;
    if road.kind == RoadKind::Motorway {
        paint += motorway_paint(s, d, [fs, fd]);
    } else if clear > 9.0 {
        let open = cover(clear, 9.5, 1e6, fs);
        if d.abs() < 0.1 + fd {
            paint += cover_periodic(s, 0.0, 3.0, 7.0, fs) * cover(d, -0.07, 0.07, fd) * open;
        }
        if (d.abs() - 3.5).abs() < 0.1 + fd {
            paint += cover(d.abs(), 3.45, 3.57, fd) * cover_periodic(s, 0.0, 0.6, 1.4, fs) * open;
        }
    }
    if clear < 9.0 + fs {
        let stripes = cover_periodic(d, 0.25, 0.75, 1.0, fd) * cover(d.abs(), 0.0, half - 0.3, fd);
        paint += cover(clear, 4.8, 7.8, fs) * stripes;
        paint += cover(clear, 8.6, 9.0, fs) * cover(d.abs(), 0.15, half.min(3.4), fd);
    }
    let paint = paint.min(1.0) * (1.0 - on_crossing) * (1.0 - on_paving);
    let paint = if on_paving > 0.0 { paint.max(middle_lines(road, [s, d], [fs, fd])) } else { paint };
    if paint > 0.0 {
        let worn = (0.82 + 0.35 * fine + 0.2 * coarse).clamp(0.25, 1.0);
        colour = mixed(colour, [0.86, 0.86, 0.83], paint * worn);
    }
    colour
}
