//! Triangles with materials.

use nalgebra::{Point3, Vector3};

/// Material of a surface; each has its own meaning of the three vertex attributes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Material {
    /// Carriageway, pavement and verge: (s, d, height above the carriageway).
    Ground,
    /// A wall of a building: (along, up, unused).
    Facade(u32),
    /// A roof: (along, across, unused).
    Roof(u32),
    /// Trunks and posts: (round, up, unused), with a colour.
    Post([f32; 3]),
    /// Crowns and hedges: (u, v, brightness), with a colour.
    Leaves([f32; 3]),
    /// A vehicle's skin: (x, y, z) of the vehicle frame as fractions of length, width, height.
    Skin(Part),
}

/// Parts of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Body,
    Cabin,
    Cargo,
    Tyre,
    Hub,
    /// Mirrors and rails, with varied appearance; frames and drawbars.
    Trim,
}

/// Appearance of a building.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Building {
    pub wall: [f32; 3],
    pub roof: [f32; 3],
    pub height_m: f32,
    /// Window pitch along and up, window size along and up \[m\].
    pub pitch_m: [f32; 2],
    pub window_m: [f32; 2],
    /// Brick courses instead of plaster.
    pub brick: bool,
    pub seed: u64,
}

/// A vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    pub position: Point3<f64>,
    pub attributes: [f64; 3],
}

/// A triangle; its normal points out of the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub corners: [Vertex; 3],
    pub normal: Vector3<f64>,
    pub material: Material,
}

/// A mesh of triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub triangles: Vec<Triangle>,
}

impl Mesh {
    pub(crate) fn triangle(&mut self, corners: [Vertex; 3], material: Material) {
        let [a, b, c] = corners.map(|v| v.position);
        let normal = (b - a).cross(&(c - a));
        let size = normal.norm();
        // Degenerate triangles have no direction and no area.
        if size > 1e-9 {
            self.triangles.push(Triangle { corners, normal: normal / size, material });
        }
    }

    /// A quadrilateral, counter-clockwise seen from outside.
    pub(crate) fn quad(&mut self, [a, b, c, d]: [Vertex; 4], material: Material) {
        self.triangle([a, b, c], material);
        self.triangle([a, c, d], material);
    }
}

/// Part of the static scenery, small enough to be culled as a whole.
#[derive(Clone, Debug)]
pub(crate) struct Chunk {
    pub centre: Point3<f64>,
    pub radius_m: f64,
    pub mesh: Mesh,
}

impl Chunk {
    /// A mesh with its bounding sphere; `None` for an empty one.
    pub(crate) fn around(mesh: Mesh) -> Option<Self> {
        let corners = || mesh.triangles.iter().flat_map(|t| t.corners.iter().map(|v| v.position));
        let count = corners().count();
        if count == 0 {
            return None;
        }
        let centre = Point3::from(corners().map(|p| p.coords).sum::<Vector3<f64>>() / count as f64);
        let radius_m = corners().map(|p| (p - centre).norm()).fold(0.0, f64::max);
        Some(Self { centre, radius_m, mesh })
    }
}
