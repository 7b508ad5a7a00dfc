//! The page as a whole.

use motorcade::{RunContext, RunResult};
use motorcade_evaluate::Report as Evaluation;

use crate::player::{Picture, data, player};
use crate::{ahead, details, elevation, evaluation, headline, map, road, speed, strip, vehicles};

/// What a report is made of.
#[derive(Clone, Copy)]
pub struct Report<'a> {
    /// The drive.
    pub result: &'a RunResult,
    /// Facts about the run.
    pub context: &'a RunContext,
    /// Errors, where ground truth is known.
    pub evaluation: Option<&'a Evaluation>,
    /// Pictures of frames; empty for a report without.
    pub pictures: &'a [Picture],
}

/// The script of the page; each part stands alone but for the first.
const SCRIPT: [&str; 5] = [
    include_str!("page/drive.js"),
    include_str!("page/charts.js"),
    include_str!("page/map.js"),
    include_str!("page/picture.js"),
    include_str!("page/player.js"),
];

impl Report<'_> {
    /// The run as one self-contained HTML page. Lengths are in metres; the map shows the world of the first camera (x right,
    /// y down, z forward) from above. With an evaluation it shows the errors and the true path.
    pub fn html(&self) -> String {
        let data = data(self.result, self.pictures, &self.context.config);
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; \
             img-src data:; script-src 'unsafe-inline'\">\n<title>motorcade run</title>\n<link rel=\"icon\" href=\"data:,\">\n\
             <style>\n{}</style></head>\n<body>\n{}<footer>motorcade {}</footer>\n\
             <script type=\"application/json\" id=\"data\">{data}</script>\n<script>\n{}</script>\n</body></html>\n",
            include_str!("page/page.css"),
            self.body(),
            env!("CARGO_PKG_VERSION"),
            SCRIPT.concat()
        )
    }

    fn body(&self) -> String {
        let result = self.result;
        let truth = self.evaluation.map(|e| e.truth_path_m.as_slice()).unwrap_or_default();
        let speeds = motorcade::speeds(result, &self.context.config);
        [
            headline::headline(result, self.context),
            details::warnings(result),
            ahead::quoted(result, &speeds),
            player(result, self.pictures),
            "<section><h2>Top view</h2>\n".to_owned(),
            map::map(result, truth),
            "</section>\n".to_owned(),
            self.evaluation.map(evaluation::evaluation).unwrap_or_default(),
            "<section class=\"over-time\"><h2>Over time</h2>\n".to_owned(),
            strip::strip(result),
            speed::speeds(result, &speeds),
            ahead::distances(result, &speeds),
            elevation::elevation(result),
            road::road(result),
            "</section>\n<section><h2>Vehicles</h2>\n".to_owned(),
            vehicles::table(result),
            "</section>\n".to_owned(),
            details::timings(result),
            details::settings(self.context),
        ]
        .concat()
    }
}
