//! Writing of maps.

use super::bytes::{checksum, upper_triangle};
use super::{MAGIC, PlaceMap, VERSION};
use crate::keyframe::PlacedKeyframe;

impl PlaceMap {
    /// The map as bytes, little-endian: `MCDRMAP\n`, version (u32), intrinsics (fx, fy, cx, cy f64; width, height u32), height (f64), keyframes
    /// (count u32), FNV-1a of all before (u64). A keyframe: frame (u64), segment (u32), rotation x y z w and translation of
    /// `world_from_camera`, way (f64), upper triangle of its covariance row by row (21 × f64), landmarks (count u32). A landmark: descriptor (4 × u64), pixel (2 × f32), level and orientation (u8),
    /// position in the camera (3 × f32), relative standard deviation of depth (f32).
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&VERSION.to_le_bytes());
        let c = &self.camera;
        for number in [c.fx, c.fy, c.cx, c.cy] {
            out.extend_from_slice(&number.to_le_bytes());
        }
        out.extend_from_slice(&c.width.to_le_bytes());
        out.extend_from_slice(&c.height.to_le_bytes());
        out.extend_from_slice(&self.height_m.to_le_bytes());
        out.extend_from_slice(&(self.keyframes.len() as u32).to_le_bytes());
        for keyframe in &self.keyframes {
            write_keyframe(&mut out, keyframe);
        }
        let sum = checksum(&out);
        out.extend_from_slice(&sum.to_le_bytes());
        out
    }
}

fn write_keyframe(out: &mut Vec<u8>, keyframe: &PlacedKeyframe) {
    out.extend_from_slice(&(keyframe.frame as u64).to_le_bytes());
    out.extend_from_slice(&(keyframe.segment as u32).to_le_bytes());
    let (q, t) = (keyframe.world_from_camera.rotation(), keyframe.world_from_camera.translation());
    for number in [q.i, q.j, q.k, q.w, t.x, t.y, t.z, keyframe.way_m] {
        out.extend_from_slice(&number.to_le_bytes());
    }
    for (row, column) in upper_triangle() {
        out.extend_from_slice(&keyframe.covariance[(row, column)].to_le_bytes());
    }
    let known =
        keyframe.landmarks.iter().filter_map(|l| Some((l, keyframe.features.get(l.feature as usize)?)));
    out.extend_from_slice(&(known.clone().count() as u32).to_le_bytes());
    for (landmark, feature) in known {
        for word in feature.descriptor.0 {
            out.extend_from_slice(&word.to_le_bytes());
        }
        for number in feature.pixel {
            out.extend_from_slice(&number.to_le_bytes());
        }
        out.extend_from_slice(&[feature.level, feature.turn]);
        for number in landmark.point_in_camera.into_iter().chain([landmark.depth_sigma]) {
            out.extend_from_slice(&number.to_le_bytes());
        }
    }
}
