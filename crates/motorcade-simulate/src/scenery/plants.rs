//! Trees, hedges, lamps and signs.

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::ground::kerb_height_m;
use crate::mesh::{Chunk, Material, Mesh, Vertex};
use crate::motion::Road;

/// Site point at (s, d) on the pavement.
fn foot(road: &Road, (s, d): (f64, f64)) -> Point3<f64> {
    road.point(s, d) + Vector3::z() * kerb_height_m(road, s)
}

/// An upright prism.
fn post(mesh: &mut Mesh, foot: Point3<f64>, height_m: f64, radii_m: (f64, f64), colour: [f32; 3]) {
    const SIDES: usize = 7;
    let ring = |i: usize, top: bool| {
        let angle = i as f64 / SIDES as f64 * TAU;
        let (radius, up) = if top { (radii_m.1, height_m) } else { (radii_m.0, -0.5) };
        let position = foot + Vector3::new(radius * angle.cos(), radius * angle.sin(), up);
        Vertex { position, attributes: [angle * radii_m.0, up, 0.0] }
    };
    for i in 0..SIDES {
        mesh.quad(
            [ring(i, false), ring(i + 1, false), ring(i + 1, true), ring(i, true)],
            Material::Post(colour),
        );
    }
}

/// A post at any site point.
pub(crate) fn pole(foot: Point3<f64>, height_m: f64, radius_m: f64, colour: [f32; 3]) -> Option<Chunk> {
    let mut mesh = Mesh::default();
    post(&mut mesh, foot, height_m, (radius_m, 0.85 * radius_m), colour);
    Chunk::around(mesh)
}

/// A trunk with a lumpy crown of a few balls.
pub(super) fn tree(road: &Road, place: (f64, f64), height_m: f64, rng: &mut ChaCha8Rng) -> Option<Chunk> {
    let mut mesh = Mesh::default();
    let foot = foot(road, place);
    post(
        &mut mesh,
        foot,
        0.62 * height_m,
        (0.02 * height_m + 0.05, 0.012 * height_m + 0.03),
        [0.27, 0.22, 0.17],
    );
    let tint = rng.random_range(0.0..1.0_f32);
    let colour = [0.20 + 0.12 * tint, 0.30 + 0.06 * tint, 0.12 + 0.03 * tint];
    let crown = 0.26 * height_m;
    for i in 0..5 {
        let angle = f64::from(i) / 4.0 * TAU + rng.random_range(0.0..0.8);
        let out = if i == 4 { 0.0 } else { 0.55 * crown };
        let up = 0.66 * height_m + if i == 4 { 0.45 * crown } else { rng.random_range(-0.2..0.2) * crown };
        let centre = foot + Vector3::new(out * angle.cos(), out * angle.sin(), up);
        ball(&mut mesh, centre, crown * rng.random_range(0.65..0.9), colour, rng);
    }
    Chunk::around(mesh)
}

/// A low round bush.
pub(super) fn bush(road: &Road, place: (f64, f64), radius_m: f64, rng: &mut ChaCha8Rng) -> Option<Chunk> {
    let mut mesh = Mesh::default();
    let colour = [rng.random_range(0.17..0.27), rng.random_range(0.27..0.34), 0.13];
    let centre = foot(road, place) + Vector3::z() * (0.5 * radius_m);
    ball(&mut mesh, centre, radius_m, colour, rng);
    Chunk::around(mesh)
}

/// A ball with bumps, lighter above.
fn ball(mesh: &mut Mesh, centre: Point3<f64>, radius_m: f64, colour: [f32; 3], rng: &mut ChaCha8Rng) {
    const ROUND: usize = 9;
    const RINGS: usize = 6;
    let bumps: Vec<f64> = (0..ROUND * (RINGS + 1)).map(|_| rng.random_range(0.82..1.12)).collect();
    let shift: f64 = rng.random_range(0.0..50.0);
    let vertex = |i: usize, j: usize| {
        let (angle, tilt) = (i as f64 / ROUND as f64 * TAU, (j as f64 / RINGS as f64 - 0.5) * 0.5 * TAU);
        let pole = j == 0 || j == RINGS;
        let bump = if pole { 0.95 } else { bumps[j * ROUND + i % ROUND] };
        let direction = Vector3::new(tilt.cos() * angle.cos(), tilt.cos() * angle.sin(), tilt.sin());
        let light = 0.8 + 0.45 * direction.z;
        let attributes = [angle * radius_m + shift, tilt * radius_m + shift, light];
        Vertex { position: centre + direction * (radius_m * bump), attributes }
    };
    for j in 0..RINGS {
        for i in 0..ROUND {
            let quad = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            mesh.quad(quad, Material::Leaves(colour));
        }
    }
}

/// A hedge along the pavement's back.
pub(super) fn hedge(
    road: &Road,
    (from, to): (f64, f64),
    d: f64,
    height_m: f64,
    rng: &mut ChaCha8Rng,
) -> Option<Chunk> {
    const THICK_M: f64 = 0.7;
    let mut mesh = Mesh::default();
    let colour = [rng.random_range(0.17..0.27), rng.random_range(0.27..0.34), 0.13];
    let outer = d + THICK_M * d.signum();
    let vertex = |s: f64, d: f64, up: f64, v: f64, light: f64| Vertex {
        position: foot(road, (s, d)) + Vector3::z() * up,
        attributes: [s, v, light],
    };
    let steps = ((to - from) / 2.0).ceil().max(1.0) as usize;
    for i in 0..steps {
        let at = |k: usize| from + (to - from) * k as f64 / steps as f64;
        let (a, b) = (at(i), at(i + 1));
        let top = height_m;
        let face = [
            vertex(a, d, -0.3, 0.0, 0.75),
            vertex(b, d, -0.3, 0.0, 0.75),
            vertex(b, d, top, top, 1.0),
            vertex(a, d, top, top, 1.0),
        ];
        let cover = [
            vertex(a, d, top, top, 1.15),
            vertex(b, d, top, top, 1.15),
            vertex(b, outer, top, top + THICK_M, 1.15),
            vertex(a, outer, top, top + THICK_M, 1.15),
        ];
        let back = [
            vertex(a, outer, -0.3, 0.0, 0.7),
            vertex(b, outer, -0.3, 0.0, 0.7),
            vertex(b, outer, top, top, 0.9),
            vertex(a, outer, top, top, 0.9),
        ];
        mesh.quad(face, Material::Leaves(colour));
        mesh.quad(cover, Material::Leaves(colour));
        mesh.quad(back, Material::Leaves(colour));
    }
    for s in [from, to] {
        // Across the end the texture runs with the depth of the hedge.
        let corner = |d: f64, up: f64, across: f64, light: f64| {
            let mut vertex = vertex(s, d, up, up.max(0.0), light);
            vertex.attributes[0] = s + across;
            vertex
        };
        let end = [
            corner(d, -0.3, 0.0, 0.8),
            corner(outer, -0.3, THICK_M, 0.8),
            corner(outer, height_m, THICK_M, 1.0),
            corner(d, height_m, 0.0, 1.0),
        ];
        mesh.quad(end, Material::Leaves(colour));
    }
    Chunk::around(mesh)
}

/// A street lamp, its arm over the road.
pub(super) fn lamp(road: &Road, (s, d): (f64, f64)) -> Option<Chunk> {
    let mut mesh = Mesh::default();
    let grey = [0.40, 0.41, 0.42];
    let base = foot(road, (s, d));
    post(&mut mesh, base, 6.5, (0.085, 0.05), grey);
    let inward = road.point(s, d - d.signum()) - road.point(s, d);
    let along = Vector3::new(-inward.y, inward.x, 0.0) * 0.09;
    let (near, far) = (base + Vector3::z() * 6.45, base + Vector3::z() * 6.6 + inward * 1.6);
    let vertex = |position: Point3<f64>, u: f64, v: f64| Vertex { position, attributes: [u, v, 0.0] };
    let up = Vector3::z() * 0.12;
    mesh.quad(
        [
            vertex(near - along, 0.0, 0.0),
            vertex(far - along, 1.6, 0.0),
            vertex(far + along, 1.6, 0.2),
            vertex(near + along, 0.0, 0.2),
        ],
        Material::Post(grey),
    );
    mesh.quad(
        [
            vertex(near, 0.0, 0.0),
            vertex(far, 1.6, 0.0),
            vertex(far + up, 1.6, 0.2),
            vertex(near + up, 0.0, 0.2),
        ],
        Material::Post(grey),
    );
    Chunk::around(mesh)
}

/// A traffic sign that faces the traffic of its side.
pub(super) fn sign(road: &Road, (s, d): (f64, f64), rng: &mut ChaCha8Rng) -> Option<Chunk> {
    let mut mesh = Mesh::default();
    let base = foot(road, (s, d));
    post(&mut mesh, base, 2.9, (0.035, 0.035), [0.55, 0.55, 0.55]);
    let across = (road.point(s, d + 1.0) - road.point(s, d)) * 0.36;
    let forward = Vector3::new(across.y, -across.x, 0.0).normalize() * (0.06 * d.signum());
    let middle = base + Vector3::z() * 2.5 + forward;
    let colours = [[0.75, 0.12, 0.10], [0.12, 0.25, 0.60], [0.88, 0.88, 0.86], [0.85, 0.70, 0.12]];
    let (rim, inner) = (colours[rng.random_range(0..colours.len())], [0.90, 0.90, 0.88]);
    let sides = if rng.random_bool(0.5) { 12 } else { 3 };
    for (size, nudge, colour) in [(1.0, 0.0, rim), (0.68, 0.012, inner)] {
        let at = |i: usize| {
            let angle = i as f64 / f64::from(sides) * TAU + 0.25 * TAU;
            let position = middle
                + forward * (nudge / 0.06)
                + across * (size * angle.cos())
                + Vector3::z() * (0.36 * size * angle.sin());
            Vertex { position, attributes: [angle, size, 0.0] }
        };
        let centre = Vertex { position: middle + forward * (nudge / 0.06), attributes: [0.0, 0.0, 0.0] };
        for i in 0..sides as usize {
            mesh.triangle([centre, at(i), at(i + 1)], Material::Post(colour));
        }
    }
    Chunk::around(mesh)
}
