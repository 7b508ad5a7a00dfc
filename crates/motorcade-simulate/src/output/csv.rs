//! Measurements as tables.

use std::fmt::Write;

use motorcade_shape::Layout;

use crate::measure::{KeypointMeasurement, Measurements};

/// `frame,track_id,layout,index,name,x_px,y_px,confidence`; names contain commas and are quoted.
pub(super) fn keypoints<'a>(rows: impl Iterator<Item = &'a KeypointMeasurement>) -> String {
    let mut text = String::from("frame,track_id,layout,index,name,x_px,y_px,confidence\n");
    for k in rows {
        let layout = match k.layout {
            Layout::Car36 => "car-36",
            Layout::Car14 => "car-14",
        };
        let (x, y) = (k.pixel.x, k.pixel.y);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{},{},{layout},{},\"{}\",{x:.3},{y:.3},{:.4}",
            k.frame, k.track_id, k.index, k.name, k.confidence
        );
    }
    text
}

/// `point,x_m,y_m,z_m` in the first camera.
pub(super) fn landmarks(all: &Measurements) -> String {
    let mut text = String::from("point,x_m,y_m,z_m\n");
    for (i, p) in all.landmarks_in_world.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{i},{:.6},{:.6},{:.6}", p.x, p.y, p.z);
    }
    text
}

/// `frame,point,x_px,y_px,outlier`.
pub(super) fn points(all: &Measurements) -> String {
    let mut text = String::from("frame,point,x_px,y_px,outlier\n");
    for o in &all.points {
        let _ = writeln!(
            text,
            "{},{},{:.4},{:.4},{}",
            o.frame,
            o.point,
            o.pixel.x,
            o.pixel.y,
            u8::from(o.outlier)
        );
    }
    text
}

/// `frame,x_px,y_px,next_x_px,next_y_px,outlier`.
pub(super) fn road_matches(all: &Measurements) -> String {
    let mut text = String::from("frame,x_px,y_px,next_x_px,next_y_px,outlier\n");
    for m in &all.road_matches {
        let (a, b) = (m.first, m.second);
        let _ =
            writeln!(text, "{},{:.4},{:.4},{:.4},{:.4},{}", m.frame, a.x, a.y, b.x, b.y, u8::from(m.outlier));
    }
    text
}
