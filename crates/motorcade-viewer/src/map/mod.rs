//! Trajectories in the top view, to scale.

mod drawing;
mod grid;
mod labels;
mod view;

use motorcade::RunResult;
use nalgebra::Vector2;

use crate::text::px;
use drawing::{camera, vehicle};
use grid::{grid, legend};
use labels::labels;
use view::{View, WIDTH_PX};

/// The map as SVG; `truth` is the true path of the camera in the world of the run \[m\], empty when unknown.
pub(crate) fn map(result: &RunResult, truth: &[[f64; 3]]) -> String {
    let Some(view) = View::of(result, truth) else {
        return "<p>No frame has a pose.</p>".to_owned();
    };
    let [x1, y1, x2, y2] = view.frame();
    let (w, h) = (px(x2 - x1), px(y2 - y1));
    let mut out = format!(
        "<div class=\"sideways\"><svg class=\"map\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Trajectories, top view\" data-map=\"{}\">\
         <defs><clipPath id=\"map-clip\"><rect x=\"{x1}\" y=\"{y1}\" width=\"{w}\" height=\"{h}\"/></clipPath></defs>\n",
        px(WIDTH_PX),
        px(view.height_px),
        view.linear()
    );
    out += &grid(&view);
    out += "<g clip-path=\"url(#map-clip)\">\n";
    for (k, trajectory) in result.vehicles.iter().enumerate() {
        out += &vehicle(&view, trajectory, k);
    }
    out += &camera(&view, result);
    // Its dashes lie on the estimate, which it hardly leaves.
    if !truth.is_empty() {
        let path = view.path(truth.iter().map(|p| Vector2::new(p[0], p[2])));
        out +=
            &format!("<polyline class=\"truth\" points=\"{path}\"><title>ground truth</title></polyline>\n");
    }
    // Labels last, on top.
    out += &labels(&view, &result.vehicles);
    out += "<g id=\"marks\"></g></g></svg></div>\n";
    out += "<div class=\"controls\"><button type=\"button\" data-zoom=\"in\" aria-label=\"Zoom the map in\">+</button>\
            <button type=\"button\" data-zoom=\"out\" aria-label=\"Zoom the map out\">&minus;</button>\
            <button type=\"button\" data-zoom=\"all\">All</button>\
            <span class=\"bar\"><i id=\"bar\"></i><output id=\"bar-length\"></output></span>\
            <span class=\"note\">Drag to move, wheel with Ctrl to zoom. Ellipses: two standard deviations in the world.</span></div>\n";
    out + &legend(!truth.is_empty())
}
