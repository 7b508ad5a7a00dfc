//! Inputs of shading: the scene of a frame, and the surface at a pixel.

use nalgebra::{Point3, Vector3};

use super::air::Air;
use super::lighting::Lighting;
use super::look::VehicleLook;
use super::repairs::Repairs;
use super::shadow::Shadows;
use super::textures::Textures;
use super::tile::Footprint;
use crate::drive::Drive;
use crate::form::Form;
use crate::mesh::{Building, Material};

/// Inputs of the shading of one frame.
pub(super) struct Scene<'a> {
    pub drive: &'a Drive,
    pub buildings: &'a [Building],
    pub textures: &'a Textures,
    pub repairs: &'a Repairs,
    /// One per vehicle.
    pub forms: &'a [Form],
    pub air: Air,
    pub shadows: Shadows,
    /// Towards the sun, in the site.
    pub sun: Vector3<f64>,
    /// Present with varied appearance.
    pub varied: Option<Varied<'a>>,
}

/// Further inputs with varied appearance.
pub(super) struct Varied<'a> {
    pub lighting: Lighting,
    /// One per vehicle.
    pub looks: &'a [VehicleLook],
    /// x, y, z of the vehicles in the site, one per vehicle.
    pub axes: Vec<[Vector3<f64>; 3]>,
}

/// Surface attributes at a pixel.
pub(super) struct Fragment {
    pub material: Material,
    pub attributes: [f64; 3],
    /// Change of the attributes to the next pixel right and down.
    pub dx: [f64; 3],
    pub dy: [f64; 3],
    /// In the site, towards the camera.
    pub normal: Vector3<f64>,
    pub point_in_site: Point3<f64>,
    pub depth_m: f64,
    /// From the camera to the point, unit, in the site.
    pub ray: Vector3<f64>,
    /// Vehicle index + 1, 0 for the world.
    pub owner: u16,
}

impl Fragment {
    /// The attributes, rounded.
    pub(super) fn place(&self) -> [f32; 3] {
        let [a, b, c] = self.attributes;
        [a as f32, b as f32, c as f32]
    }
    /// Footprint of the pixel in two of the attributes.
    pub(super) fn footprint(&self, i: usize, j: usize) -> Footprint {
        let (dx, dy) = (&self.dx, &self.dy);
        Footprint { dx: [dx[i] as f32, dx[j] as f32], dy: [dy[i] as f32, dy[j] as f32] }
    }
}
