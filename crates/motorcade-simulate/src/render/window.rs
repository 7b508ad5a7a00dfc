//! A part of a frame, rendered at a resolution of its own.

use motorcade_geometry::PinholeCamera;

use super::colour::Colour;
use super::picture::Picture;
use super::raster::{Band, NOTHING};
use super::renderer::{FrameTime, Ground, Renderer};
use super::resolve::VisiblePart;

/// Irradiance before the sensor model, row by row, with depth, instances and views; the picture's own pixels are empty.
pub(crate) struct Window {
    pub light: Vec<Colour>,
    pub picture: Picture,
}

impl Renderer<'_> {
    /// Renders the view of another camera at the pose of frame `frame`; `None` when the drive has no such frame.
    pub(crate) fn window(&self, frame: usize, camera: &PinholeCamera) -> Option<Window> {
        let pose = *self.drive().site_from_camera.get(frame)?;
        let now = FrameTime { frame, later: 0.0 };
        let (light, picture) = self.expose_once(&self.scene(now), now, camera, &pose);
        Some(Window { light, picture })
    }

    /// Extent \[px\] of the visible part of a vehicle in the columns and rows of `inside` (x1, y1, x2, y2), without shading
    /// anything; `None` when none is visible.
    pub(crate) fn visible_extent(
        &self,
        frame: usize,
        camera: &PinholeCamera,
        vehicle: usize,
        inside: [f64; 4],
    ) -> Option<[f64; 4]> {
        let pose = *self.drive().site_from_camera.get(frame)?;
        let (surfaces, drawn, _) = self.draw(camera, FrameTime { frame, later: 0.0 }, &pose, Ground::Drawn);
        let mut band = Band::new(0..camera.width as usize, 0, camera.height as usize);
        drawn.iter().enumerate().for_each(|(i, triangle)| band.draw(i as u32, triangle));
        let mut seen = VisiblePart::NONE;
        for (i, drawn_here) in band.drawn.iter().enumerate().filter(|d| *d.1 != NOTHING) {
            let owner = drawn.get(*drawn_here as usize).map_or(0, |d| surfaces[d.surface as usize].owner);
            let (x, y) = ((i % band.columns) as f64 * 0.5 - 0.25, (i / band.columns) as f64 * 0.5 - 0.25);
            let within = x >= inside[0] && x <= inside[2] && y >= inside[1] && y <= inside[3];
            if usize::from(owner) == vehicle + 1 && within {
                seen.add(x, y);
            }
        }
        (seen.samples > 0)
            .then(|| [seen.low[0] - 0.25, seen.low[1] - 0.25, seen.high[0] + 0.25, seen.high[1] + 0.25])
    }
}
