//! The player: a slider through the frames, pictures with the vehicles in them, and one vehicle that is followed.

mod frames;
mod outlines;
mod pictures;
mod vehicles;

use motorcade::{Config, RunResult};
use serde_json::json;

pub use pictures::{Picture, Pictures};

/// Picture, slider and panel; they are filled by the script of the page from [`data`].
pub(crate) fn player(result: &RunResult, pictures: &[Picture]) -> String {
    if result.ego.frames.is_empty() {
        return String::new();
    }
    let last = result.ego.frames.len() - 1;
    let picture = match pictures.first() {
        Some(_) => format!(
            "<svg id=\"picture\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"The frame with the vehicles estimated in it\"></svg>\n",
            result.camera.width, result.camera.height
        ),
        None => String::new(),
    };
    format!(
        "<section class=\"player\"><h2>Drive</h2>\n{picture}\
         <div class=\"controls\">\
         <button type=\"button\" id=\"play\" aria-label=\"Play\">&#9654;</button>\
         <input type=\"range\" id=\"slider\" min=\"0\" max=\"{last}\" value=\"0\" step=\"1\" aria-label=\"Frame\">\
         <output id=\"now\" aria-live=\"off\"></output></div>\n\
         <p class=\"note\">Keys: left and right step by a frame, with Shift by ten; space plays; Escape leaves the vehicle that is \
         followed. Click a vehicle in the picture, on the map or in the table to follow it.</p>\n\
         <div id=\"followed\" aria-live=\"polite\" hidden></div></section>\n"
    )
}

/// What the player shows, as JSON that may stand in a page.
pub(crate) fn data(result: &RunResult, pictures: &[Picture], config: &Config) -> String {
    let vehicles: Vec<_> =
        result.vehicles.iter().enumerate().map(|(k, v)| vehicles::vehicle(result, v, k)).collect();
    let data = json!({
        "frames": frames::frames(result, config),
        "vehicles": vehicles,
        "pictures": pictures::pictures(result, pictures),
    });
    // No end of a script element can stand in it.
    data.to_string().replace('<', "\\u003c")
}

/// A number with so many digits after the point; `null` where it is not finite.
fn rounded(value: f64, digits: i32) -> f64 {
    let power = 10_f64.powi(digits);
    (value * power).round() / power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!(
            json!([rounded(1.23456, 2), rounded(-0.001, 2), rounded(f64::NAN, 2)]).to_string(),
            "[1.23,-0.0,null]"
        );
    }
}
