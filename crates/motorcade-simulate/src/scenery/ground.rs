//! The ground as strips along the road.

use crate::mesh::{Chunk, Material, Mesh, Vertex};
use crate::motion::{Road, RoadKind};
use crate::scenery::{KERB_M, PAVEMENT_M};

/// Half width of the ground \[m\].
const REACH_M: f64 = 60.0;
/// The same where traffic leaves the road \[m\].
const PAVED_REACH_M: f64 = 150.0;
/// Length of road in one chunk \[m\].
const CHUNK_M: f64 = 16.0;

/// Height of the pavement above the carriageway \[m\]: 0 at crossings, beside paved ground and on motorways.
pub(crate) fn kerb_height_m(road: &Road, s: f64) -> f64 {
    if road.kind == RoadKind::Motorway {
        return 0.0;
    }
    let along = (road.to_crossing_m(s) - 4.2).min(road.along_to_paving_m(s));
    KERB_M * (along / 2.0).clamp(0.0, 1.0)
}

/// Extent of the ground to a side at `s` \[m\]: not beyond the centre of a bend.
fn reach(road: &Road, s: f64, side: f64) -> f64 {
    let towards_centre = road.at(s).curvature_per_m * side;
    let level = if road.paved.is_empty() { REACH_M } else { PAVED_REACH_M };
    let most = if towards_centre > 1e-6 { (0.9 / towards_centre).min(level) } else { level };
    if road.meets_itself() { most.min(to_other_stretch(road, s, side, most)) } else { most }
}

/// Distance to the side at which another stretch of a road that meets itself becomes the nearer one \[m\].
fn to_other_stretch(road: &Road, s: f64, side: f64, most: f64) -> f64 {
    const STEP_M: f64 = 1.0;
    let own = |d: f64| road.locate(&road.point(s, side * d).xy()).1.abs() > d - 0.02;
    let steps = (most / STEP_M).ceil() as usize;
    let Some(beyond) = (1..=steps).map(|i| (i as f64 * STEP_M).min(most)).find(|d| !own(*d)) else {
        return most;
    };
    let (mut inside, mut outside) = ((beyond - STEP_M).max(0.0), beyond);
    for _ in 0..10 {
        let middle = 0.5 * (inside + outside);
        if own(middle) { inside = middle } else { outside = middle }
    }
    inside
}

/// The ground over the whole road.
pub(super) fn chunks(road: &Road) -> Vec<Chunk> {
    let (from, to) = road.extent_m();
    let mut chunks = Vec::new();
    let count = ((to - from) / CHUNK_M).ceil() as usize;
    for c in 0..count {
        let mut mesh = Mesh::default();
        let begin = from + c as f64 * CHUNK_M;
        let end = (begin + CHUNK_M).min(to);
        let mut s = begin;
        while s < end - 1e-9 {
            let next = (s + 1.0).min(end);
            if !(road.is_again(s) && road.is_again(next)) {
                cross_sections(road, s, next, &mut mesh);
            }
            s = next;
        }
        chunks.extend(Chunk::around(mesh));
    }
    chunks
}

fn cross_sections(road: &Road, a: f64, b: f64, mesh: &mut Mesh) {
    let half = road.half_width_m;
    // On each side, at each end: on a road that meets itself the ground ends where that of another stretch begins.
    let outers = [-1.0, 1.0].map(|side| {
        let ends = [a, b].map(|s| reach(road, s, side));
        let both = ends[0].min(ends[1]).max(half + 0.2);
        if road.meets_itself() { ends } else { [both; 2] }
    });
    let vertex = |s: f64, d: f64, h: f64| {
        let most = outers[usize::from(d > 0.0)][usize::from(s == b)];
        let d = d.clamp(-most, most);
        let mut position = road.point(s, d);
        position.z += h;
        Vertex { position, attributes: [s, d, h] }
    };
    let mut strip = |d0: f64, h0: f64, d1: f64, h1: f64, ends: [f64; 2]| {
        let quad = [
            vertex(a, d0, h0 * ends[0]),
            vertex(b, d0, h0 * ends[1]),
            vertex(b, d1, h1 * ends[1]),
            vertex(a, d1, h1 * ends[0]),
        ];
        mesh.quad(quad, Material::Ground);
    };
    let lift = [kerb_height_m(road, a), kerb_height_m(road, b)];
    strip(-half, 0.0, 0.0, 0.0, lift);
    strip(0.0, 0.0, half, 0.0, lift);
    for (side, ends) in [-1.0, 1.0].into_iter().zip(outers) {
        let outer = ends[0].max(ends[1]);
        let pavement = (half + PAVEMENT_M).min(outer);
        strip(side * half, 0.0, side * half, 1.0, lift);
        strip(side * half, 1.0, side * pavement, 1.0, lift);
        if outer > pavement {
            let middle = (pavement + 8.0).min(outer);
            strip(side * pavement, 1.0, side * middle, 1.0, lift);
            if outer > middle {
                strip(side * middle, 1.0, side * outer, 1.0, lift);
            }
        }
    }
}
