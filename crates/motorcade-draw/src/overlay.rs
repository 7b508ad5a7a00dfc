//! Frames of one camera with their estimates drawn in.

use image::RgbImage;
use motorcade_geometry::{BoundingBox, PinholeCamera};

use crate::canvas::Canvas;
use crate::label::Label;
use crate::layout::Layout;
use crate::placement::Placement;
use crate::scene::Scene;
use crate::segment::Rectangle;
use crate::vehicle::{Placed, colour};
use crate::view::View;
use crate::{grid, panel, trail};

/// Draws estimates into the frames of one camera.
#[derive(Clone, Debug)]
pub struct Overlay {
    view: View,
    layout: Layout,
    /// Parts of the image in front of the road and the scene.
    fixed: Vec<Rectangle>,
}

impl Overlay {
    /// For the (undistorted) frames of a camera.
    pub fn new(camera: PinholeCamera) -> Self {
        let layout = Layout::of(camera.width, camera.height);
        Self { view: View::new(camera), layout, fixed: Vec::new() }
    }

    /// Without the grid on what is fixed to the camera: rectangles around it \[px\].
    pub fn with_fixed_regions(self, regions: &[BoundingBox]) -> Self {
        let fixed = regions.iter().map(|b| Rectangle::new(b.x1, b.y1, b.x2, b.y2)).collect();
        Self { fixed, ..self }
    }

    /// Width and height of drawn frames \[px\]: even, and wider than the camera's by the panel.
    pub fn size(&self) -> (u32, u32) {
        self.layout.size
    }

    /// A frame with its estimate drawn in and the panel beside it. Pixels outside of a smaller frame are black.
    pub fn draw(&self, frame: &RgbImage, scene: &Scene) -> RgbImage {
        let (width, height) = self.layout.size;
        let Some(mut canvas) = Canvas::new(frame, width, height) else { return frame.clone() };
        let (view, layout) = (&self.view, &self.layout);
        let mut vehicles: Vec<Placed<'_>> =
            scene.vehicles.iter().filter_map(|v| Placed::new(v, view)).collect();
        vehicles.sort_by(|a, b| {
            let distance = |p: &Placed<'_>| p.vehicle.position().coords.norm_squared();
            distance(a).total_cmp(&distance(b)).then(a.vehicle.id.cmp(&b.vehicle.id))
        });
        let bounds: Vec<Rectangle> = vehicles.iter().map(|v| v.bounds).collect();
        let hiding: Vec<Rectangle> = self.fixed.iter().chain(&bounds).copied().collect();
        grid::draw(&mut canvas, view, &scene.road, layout, &hiding);
        // Far ones first: near vehicles hide them.
        for placed in vehicles.iter().rev().filter(|v| v.vehicle.moving) {
            trail::draw(&mut canvas, view, placed.vehicle, colour(placed.vehicle), &scene.road, layout);
        }
        for placed in vehicles.iter().rev() {
            placed.draw(&mut canvas, view, layout);
        }
        // Near ones first: they take the best places.
        let mut placement = Placement::new(view.image(), bounds);
        let labels: Vec<Label<'_>> =
            vehicles.iter().filter_map(|v| Label::new(v, &scene.road, layout, &mut placement)).collect();
        labels.iter().for_each(|label| label.draw_leader(&mut canvas, layout));
        labels.iter().for_each(|label| label.draw(&mut canvas));
        panel::draw(&mut canvas, scene, layout);
        canvas.into_rgb()
    }
}
