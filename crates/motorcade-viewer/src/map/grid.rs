//! Grid, axis labels and legend of the map.

use super::view::View;
use crate::axis::{Axis, round_step};
use crate::text::{px, tick};

/// Grid lines with their labels.
pub(super) fn grid(view: &View) -> String {
    let [x1, y1, x2, y2] = view.frame();
    // Square cells: both directions take the step of the longer one.
    let span = view.across.values[1] - view.across.values[0];
    let step = round_step(span / 14.0);
    let count = |axis: &Axis| (axis.values[1] - axis.values[0]) / step;
    let mut out = "<g id=\"ticks\">".to_owned();
    for value in view.across.marks(count(&view.across)).0 {
        let (x, label) = (px(view.across.at(value)), tick(value, 0));
        out += &format!("<line class=\"grid\" x1=\"{x}\" y1=\"{y1}\" x2=\"{x}\" y2=\"{}\"/>", px(y2));
        out += &format!(
            "<text class=\"tick\" x=\"{x}\" y=\"{}\" text-anchor=\"middle\">{label}</text>\n",
            px(y2 + 15.0)
        );
    }
    for value in view.down.marks(count(&view.down)).0 {
        let (y, label) = (px(view.down.at(value)), tick(value, 0));
        out += &format!("<line class=\"grid\" x1=\"{x1}\" y1=\"{y}\" x2=\"{}\" y2=\"{y}\"/>", px(x2));
        out += &format!(
            "<text class=\"tick\" x=\"{}\" y=\"{y}\" dy=\"4\" text-anchor=\"end\">{label}</text>\n",
            px(x1 - 6.0)
        );
    }
    out += "</g>";
    let (wide, high) =
        if view.turned { ("z, forward [m]", "x, right [m]") } else { ("x, right [m]", "z, forward [m]") };
    let (x, y) = (px(0.5 * (x1 + x2)), px(0.5 * (y1 + y2)));
    out += &format!(
        "<text class=\"axis\" x=\"{x}\" y=\"{}\" text-anchor=\"middle\">{wide}</text>",
        px(y2 + 32.0)
    );
    out += &format!(
        "<text class=\"axis\" transform=\"translate(12 {y}) rotate(-90)\" text-anchor=\"middle\">{high}</text>\n"
    );
    out + &format!(
        "<rect class=\"frame\" x=\"{x1}\" y=\"{y1}\" width=\"{}\" height=\"{}\"/>\n",
        px(x2 - x1),
        px(y2 - y1)
    )
}

/// Legend and switches.
pub(super) fn legend(truth: bool) -> String {
    let item = |drawing: &str, text: &str| {
        format!(
            "<span class=\"key\"><svg aria-hidden=\"true\" viewBox=\"0 0 34 14\" width=\"34\" height=\"14\">{drawing}</svg>{text}</span>"
        )
    };
    let line = |class: &str| {
        format!("<g class=\"{class}\"><line class=\"path\" x1=\"2\" y1=\"7\" x2=\"32\" y2=\"7\"/></g>")
    };
    let mut out = "<p class=\"legend\">".to_owned();
    out += &item(&line("camera"), "camera");
    if truth {
        out += &item("<line class=\"truth\" x1=\"2\" y1=\"7\" x2=\"32\" y2=\"7\"/>", "camera, ground truth");
    }
    out += &item(&line("vehicle moving"), "moving vehicle, with its id");
    out += &item(&line("vehicle moving unsure"), "one that may stand: P(moving) below 0.95");
    let body =
        "<g class=\"vehicle parked\"><rect class=\"body\" x=\"5\" y=\"2\" width=\"24\" height=\"10\"/></g>";
    out += &item(
        body,
        "parked vehicle, to size; the line points forward; faint: the detector doubts it, or does not see it",
    );
    out += &item("<g class=\"camera\"><circle class=\"start\" cx=\"17\" cy=\"7\" r=\"5\"/></g>", "start");
    out += &item("<g class=\"camera\"><circle class=\"end\" cx=\"17\" cy=\"7\" r=\"5\"/></g>", "end");
    out += "</p>\n<p class=\"legend toggles\">Show:";
    let toggle = |name: &str, text: &str| {
        format!(
            "<label class=\"toggle\"><input type=\"checkbox\" checked data-toggle=\"{name}\"> {text}</label>"
        )
    };
    out += &toggle("moving", "moving");
    out += &toggle("parked", "parked");
    out += &toggle("label", "labels");
    out + "</p>\n"
}
