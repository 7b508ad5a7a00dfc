//! Title and headline numbers.

use motorcade::{RunContext, RunResult};

use crate::outline::is_moving;
use crate::text::{escape, number};

/// Title and headline numbers.
pub(crate) fn headline(result: &RunResult, context: &RunContext) -> String {
    let input = &context.input;
    let mut facts = vec![input.format.name().to_owned()];
    facts.extend(input.sequence.as_ref().map(|s| format!("sequence {s}")));
    facts.extend(input.camera.map(|c| format!("camera {c}")));
    facts.push(format!("frames {} to {}", input.numbers.0, input.numbers.1));
    facts.push(format!("{} s", number(input.duration_s, 1)));
    facts.push(format!("{}×{} px", input.width, input.height));
    facts.push(format!("camera {} m above the road", number(result.ego.height_m, 2)));
    let moving = result.vehicles.iter().filter(|v| is_moving(v)).count();
    let vehicles = |count: usize| if result.detects_vehicles { count.to_string() } else { "–".to_owned() };
    let cards = [
        (result.frames.len().to_string(), "frames"),
        (format!("{} m", number(result.ego.length_m(), 1)), "driven"),
        (format!("{} %", number(100.0 * result.tracked_share(), 1)), "of frames tracked"),
        (
            vehicles(result.vehicles.len()),
            if result.detects_vehicles { "vehicles" } else { "no vehicle detector" },
        ),
        (vehicles(moving), "of them moving"),
    ];
    let card = |(value, name): &(String, &str)| {
        format!("<div class=\"card\"><b>{}</b><span>{}</span></div>", escape(value), escape(name))
    };
    let mut out = format!("<header><h1>motorcade run</h1><p>{}</p></header>\n", escape(&facts.join(" · ")));
    if result.interrupted {
        out += "<p class=\"warning\">Interrupted: results up to the last processed frame.</p>\n";
    }
    out + "<section class=\"cards\">" + &cards.iter().map(card).collect::<String>() + "</section>\n"
}
