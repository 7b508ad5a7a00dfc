//! Landmarks of a map as points for other programs.

use super::PlaceMap;

impl PlaceMap {
    /// Landmarks and cameras as an ASCII PLY file: x, y, z in the world \[m\], grey for landmarks, orange for cameras.
    pub fn to_ply(&self) -> String {
        let count = self.keyframes.len() + self.keyframes.iter().map(|k| k.landmarks.len()).sum::<usize>();
        let mut out = format!(
            "ply\nformat ascii 1.0\ncomment world: first camera, x right, y down, z forward, metres\nelement vertex {count}\n\
             property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
        );
        for keyframe in &self.keyframes {
            let t = keyframe.world_from_camera.translation();
            out.push_str(&format!("{:.3} {:.3} {:.3} 255 140 0\n", t.x, t.y, t.z));
            for landmark in &keyframe.landmarks {
                let p = keyframe.world_from_camera.transform_point(&landmark.point());
                out.push_str(&format!("{:.3} {:.3} {:.3} 160 160 160\n", p.x, p.y, p.z));
            }
        }
        out
    }
}
