//! The numbers to see first.

use motorcade::{RunContext, RunResult};

use crate::outline::moves;
use crate::text::{escape, number};

/// Heading and headline numbers.
pub(crate) fn headline(result: &RunResult, context: &RunContext) -> String {
    let input = &context.input;
    let mut what = vec![input.format.name().to_owned()];
    what.extend(input.sequence.as_ref().map(|s| format!("sequence {s}")));
    what.extend(input.camera.map(|c| format!("camera {c}")));
    what.push(format!("frames {} to {}", input.numbers.0, input.numbers.1));
    what.push(format!("{} s", number(input.duration_s, 1)));
    what.push(format!("{}×{} px", input.width, input.height));
    what.push(format!("camera {} m above the road", number(result.ego.height_m, 2)));
    let moving = result.vehicles.iter().filter(|v| moves(v)).count();
    let vehicles = |count: usize| if result.detects_vehicles { count.to_string() } else { "–".to_owned() };
    let cards = [
        (result.frames.len().to_string(), "frames"),
        (format!("{} m", number(result.ego.length_m(), 1)), "driven"),
        (format!("{} %", number(100.0 * result.tracked_share(), 1)), "of frames tracked"),
        (
            vehicles(result.vehicles.len()),
            if result.detects_vehicles { "vehicles" } else { "vehicles not looked for" },
        ),
        (vehicles(moving), "of them moving"),
    ];
    let card = |(value, name): &(String, &str)| {
        format!("<div class=\"card\"><b>{}</b><span>{}</span></div>", escape(value), escape(name))
    };
    let mut out = format!("<header><h1>motorcade run</h1><p>{}</p></header>\n", escape(&what.join(" · ")));
    if result.interrupted {
        out += "<p class=\"warning\">Interrupted: this is what there was until then.</p>\n";
    }
    out + "<section class=\"cards\">" + &cards.iter().map(card).collect::<String>() + "</section>\n"
}
