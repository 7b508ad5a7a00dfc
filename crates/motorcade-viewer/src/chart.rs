//! Charts of values over time or distance.

use crate::axis::{Axis, range};
use crate::text::{escape, points, px, tick};

const WIDTH_PX: f64 = 1100.0;
const HEIGHT_PX: f64 = 240.0;
/// Left, top, right and bottom of the drawing area.
const AREA: [f64; 4] = [56.0, 10.0, 1090.0, 200.0];

/// One line of a chart.
pub(crate) struct Series {
    /// Name in the legend.
    pub name: String,
    /// CSS class, which sets the colour.
    pub class: &'static str,
    /// Hue \[deg\] of a vehicle's colour.
    pub hue: Option<u32>,
    /// Identity of its vehicle.
    pub vehicle: Option<usize>,
    /// Time \[s\] or distance \[m\], and value; a value that is not finite breaks the line.
    pub values: Vec<(f64, f64)>,
    /// Standard deviations, one per value; empty when unknown.
    pub sigmas: Vec<f64>,
}

/// Most names in a legend; the tooltip and the table name the others.
const MOST_KEYS: usize = 24;

/// What runs along the horizontal axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Across {
    /// Time since the first frame \[s\].
    Time,
    /// Distance driven \[m\].
    Way,
}

impl Across {
    /// Name of the column of frames, unit and label of the axis.
    fn words(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Self::Time => ("time", "s", "time since the first frame [s]"),
            Self::Way => ("way", "m", "distance driven [m]"),
        }
    }
}

/// Lines over one axis.
pub(crate) struct Chart<'a> {
    /// Heading.
    pub title: &'a str,
    /// Axis label, with the unit.
    pub label: &'a str,
    /// Unit of the values.
    pub unit: &'a str,
    /// Smallest range shown, in that unit.
    pub least: f64,
    /// True when the axis includes zero.
    pub from_zero: bool,
    /// The horizontal axis.
    pub across: Across,
    /// The lines.
    pub series: Vec<Series>,
}

impl Chart<'_> {
    /// The chart as a figure; nothing when it has no values.
    pub(crate) fn figure(&self) -> String {
        let times = range(self.series.iter().flat_map(|s| s.values.iter().map(|v| v.0)), 0.0, 0.1);
        let all = self.series.iter().flat_map(Series::extent).chain(self.from_zero.then_some(0.0));
        let (Some(times), Some(values)) = (times, range(all, 0.06, self.least)) else {
            return String::new();
        };
        let across = Axis { values: times, pixels: [AREA[0], AREA[2]] };
        let up = Axis { values, pixels: [AREA[3], AREA[1]] };
        let pair = |axis: &Axis| {
            format!("{} {} {} {}", axis.values[0], axis.values[1], axis.pixels[0], axis.pixels[1])
        };
        let mut out = format!(
            "<figure><h3>{}</h3><div class=\"sideways\"><svg class=\"chart\" viewBox=\"0 0 {WIDTH_PX} {HEIGHT_PX}\" role=\"img\" aria-label=\"{}\" \
             data-x=\"{}\" data-y=\"{}\" data-unit=\"{}\" data-across=\"{}\" data-across-unit=\"{}\">\n",
            escape(self.title),
            escape(self.title),
            pair(&across),
            pair(&up),
            escape(self.unit),
            self.across.words().0,
            self.across.words().1
        );
        out += &self.axes(&across, &up);
        // Bands first, behind all lines.
        for series in &self.series {
            out += &series.band(&across, &up);
        }
        for series in &self.series {
            out += &series.line(&across, &up);
        }
        out += "<line class=\"now\" y1=\"10\" y2=\"200\" x1=\"-9\" x2=\"-9\"/>\
                <line class=\"cross\" y1=\"10\" y2=\"200\" x1=\"-9\" x2=\"-9\"/></svg></div>\n<p class=\"legend\">";
        for series in self.series.iter().take(MOST_KEYS) {
            out += &series.key();
        }
        if self.series.len() > MOST_KEYS {
            out += &format!("<span class=\"key\">and {} more</span>", self.series.len() - MOST_KEYS);
        }
        out + "<output class=\"readout\"></output></p></figure>\n"
    }

    fn axes(&self, across: &Axis, up: &Axis) -> String {
        let [x1, y1, x2, y2] = AREA;
        let mut out = String::new();
        let (marks, digits) = up.marks(5.0);
        for value in marks {
            let (y, label) = (px(up.at(value)), tick(value, digits));
            out += &format!("<line class=\"grid\" x1=\"{x1}\" y1=\"{y}\" x2=\"{x2}\" y2=\"{y}\"/>");
            out += &format!(
                "<text class=\"tick\" x=\"{}\" y=\"{y}\" dy=\"4\" text-anchor=\"end\">{label}</text>\n",
                x1 - 6.0
            );
        }
        let (marks, digits) = across.marks(12.0);
        for value in marks {
            let (x, label) = (px(across.at(value)), tick(value, digits));
            out += &format!("<line class=\"grid\" x1=\"{x}\" y1=\"{y1}\" x2=\"{x}\" y2=\"{y2}\"/>");
            out += &format!(
                "<text class=\"tick\" x=\"{x}\" y=\"{}\" text-anchor=\"middle\">{label}</text>\n",
                y2 + 15.0
            );
        }
        let (x, y) = (0.5 * (x1 + x2), 0.5 * (y1 + y2));
        out += &format!(
            "<text class=\"axis\" x=\"{x}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            y2 + 32.0,
            self.across.words().2
        );
        let label = escape(self.label);
        out + &format!(
            "<text class=\"axis\" transform=\"translate(12 {y}) rotate(-90)\" text-anchor=\"middle\">{label}</text>\n"
        )
    }
}

impl Series {
    /// Values and the edges of their bands.
    fn extent(&self) -> impl Iterator<Item = f64> + '_ {
        let sigma = |k: usize| self.sigmas.get(k).copied().unwrap_or(0.0);
        self.values.iter().enumerate().flat_map(move |(k, v)| [v.1 - sigma(k), v.1 + sigma(k)])
    }

    fn style(&self) -> String {
        let hue = self.hue.map(|h| format!(" style=\"--h:{h}\"")).unwrap_or_default();
        let vehicle = self.vehicle.map(|id| format!(" data-vehicle=\"{id}\"")).unwrap_or_default();
        format!("class=\"{}\"{hue}{vehicle}", self.class)
    }

    /// Ranges of neighbours with finite values.
    fn pieces(&self) -> Vec<std::ops::Range<usize>> {
        let mut out: Vec<std::ops::Range<usize>> = Vec::new();
        for (k, (_, value)) in self.values.iter().enumerate() {
            match out.last_mut() {
                _ if !value.is_finite() => {}
                Some(piece) if piece.end == k => piece.end = k + 1,
                _ => out.push(k..k + 1),
            }
        }
        out
    }

    fn band(&self, across: &Axis, up: &Axis) -> String {
        if self.sigmas.len() != self.values.len() {
            return String::new();
        }
        let edge = |k: usize, sign: f64| {
            let (time, value) = self.values[k];
            (across.at(time), up.at(value + sign * self.sigmas[k]))
        };
        let piece = |piece: std::ops::Range<usize>| {
            let upper = piece.clone().map(|k| edge(k, 1.0));
            let outline = points(upper.chain(piece.rev().map(|k| edge(k, -1.0))));
            format!("<g {}><polygon class=\"band\" points=\"{outline}\"/></g>\n", self.style())
        };
        self.pieces().into_iter().map(piece).collect()
    }

    fn line(&self, across: &Axis, up: &Axis) -> String {
        let piece = |piece: std::ops::Range<usize>| {
            let line = points(self.values[piece].iter().map(|(t, v)| (across.at(*t), up.at(*v))));
            let name = escape(&self.name);
            format!(
                "<g {}><polyline class=\"path\" data-name=\"{name}\" points=\"{line}\"/></g>\n",
                self.style()
            )
        };
        self.pieces().into_iter().map(piece).collect()
    }

    fn key(&self) -> String {
        let line = "<line class=\"path\" x1=\"2\" y1=\"7\" x2=\"24\" y2=\"7\"/>";
        format!(
            "<span class=\"key\"><svg aria-hidden=\"true\" viewBox=\"0 0 26 14\" width=\"26\" height=\"14\"><g {}>{line}</g></svg>{}</span>",
            self.style(),
            escape(&self.name)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(values: Vec<(f64, f64)>) -> Series {
        Series { name: "a<b".into(), class: "camera", hue: None, vehicle: None, sigmas: vec![], values }
    }

    #[test]
    fn gaps_break_the_line() {
        let s = series(vec![(0.0, 1.0), (1.0, 2.0), (2.0, f64::NAN), (3.0, 1.0)]);
        assert_eq!(s.pieces(), vec![0..2, 3..4]);
    }

    #[test]
    fn a_chart_without_values_is_nothing() {
        let chart = |values| Chart {
            title: "t",
            label: "l",
            unit: "m",
            least: 1.0,
            from_zero: true,
            across: Across::Time,
            series: vec![series(values)],
        };
        assert_eq!(chart(vec![]).figure(), "");
        let figure = chart(vec![(0.0, 1.0), (1.0, 3.0)]).figure();
        assert!(figure.contains("a&lt;b") && !figure.contains("NaN") && !figure.contains("a<b"));
    }
}
