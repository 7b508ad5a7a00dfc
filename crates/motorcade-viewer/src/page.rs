//! The page as a whole.

use motorcade::{RunContext, RunResult};
use motorcade_evaluate::Report;

use crate::{ahead, details, evaluation, headline, map, road, speed, strip, vehicles};

/// A run as one self-contained HTML page. Lengths are in metres; the map shows the world of the first camera (x right, y down,
/// z forward) from above. With an evaluation it shows the errors and the true path.
pub fn report(result: &RunResult, context: &RunContext, evaluation: Option<&Report>) -> String {
    let truth = evaluation.map(|e| e.truth_path_m.as_slice()).unwrap_or_default();
    let speeds = motorcade::speeds(result);
    let body = [
        headline::headline(result, context),
        details::warnings(result),
        ahead::quoted(result, &speeds),
        "<section><h2>Top view</h2>\n".to_owned(),
        map::map(result, truth),
        "</section>\n".to_owned(),
        evaluation.map(evaluation::evaluation).unwrap_or_default(),
        "<section><h2>Over time</h2>\n".to_owned(),
        strip::strip(result),
        speed::speeds(result),
        ahead::distances(result, &speeds),
        road::road(result),
        "</section>\n<section><h2>Vehicles</h2>\n".to_owned(),
        vehicles::table(result),
        "</section>\n".to_owned(),
        details::timings(result),
        details::settings(context),
    ];
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; \
         script-src 'unsafe-inline'\">\n<title>motorcade run</title>\n<style>\n{}</style></head>\n<body>\n{}\
         <footer>motorcade {}</footer>\n<script>\n{}</script>\n</body></html>\n",
        include_str!("page.css"),
        body.concat(),
        env!("CARGO_PKG_VERSION"),
        include_str!("page.js")
    )
}
