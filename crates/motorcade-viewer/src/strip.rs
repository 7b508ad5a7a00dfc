//! Status of every frame, as a strip.

use motorcade::RunResult;
use motorcade_odometry::FrameStatus;

use crate::text::{escape, px};

/// CSS class and description.
pub(crate) const KINDS: [(&str, &str); 5] = [
    ("tracked", "tracked"),
    ("standstill", "standing still"),
    ("filled", "filled in: before the map began"),
    ("bridged", "bridged: not tracked"),
    ("unreadable", "unreadable, bridged"),
];

/// Index into [`KINDS`] of a frame.
pub(crate) fn kind(result: &RunResult, k: usize) -> usize {
    if result.frames.get(k).is_some_and(|f| f.problem.is_some()) {
        return 4;
    }
    match result.ego.frames[k].status {
        FrameStatus::Tracked => 0,
        FrameStatus::Standstill => 1,
        FrameStatus::Initialising => 2,
        FrameStatus::Bridged => 3,
    }
}

/// The strip and its legend.
pub(crate) fn strip(result: &RunResult) -> String {
    let n = result.ego.frames.len().min(result.frames.len());
    if n == 0 {
        return String::new();
    }
    let (left, width) = (56.0, 1034.0);
    let mut out = format!(
        "<figure><h3>Frames</h3><div class=\"sideways\"><svg class=\"strip\" viewBox=\"0 0 1100 44\" data-rows=\"{left} {width} {n}\" role=\"img\" \
         aria-label=\"Status of every frame\">\n"
    );
    let mut counts = [0; KINDS.len()];
    let mut start = 0;
    while start < n {
        let kind_here = kind(result, start);
        let end = (start..n).find(|&k| kind(result, k) != kind_here).unwrap_or(n);
        counts[kind_here] += end - start;
        let (class, meaning) = KINDS[kind_here];
        let (first, last) = (result.frames[start].number, result.frames[end - 1].number);
        let which =
            if first == last { format!("frame {first}") } else { format!("frames {first} to {last}") };
        let problem = result.frames[start].problem.as_deref().map(|p| format!(": {p}")).unwrap_or_default();
        let x = left + width * start as f64 / n as f64;
        // A single frame of thousands must stay visible.
        let wide = (width * (end - start) as f64 / n as f64).max(2.0);
        out += &format!(
            "<rect class=\"{class}\" x=\"{}\" y=\"2\" width=\"{}\" height=\"20\"><title>{which}: {meaning}{}</title></rect>\n",
            px(x),
            px(wide),
            escape(&problem)
        );
        start = end;
    }
    let ends = [(left, "start", result.frames[0].number), (left + width, "end", result.frames[n - 1].number)];
    for (x, anchor, frame) in ends {
        out +=
            &format!("<text class=\"tick\" x=\"{x}\" y=\"38\" text-anchor=\"{anchor}\">frame {frame}</text>");
    }
    out += "</svg></div>\n<p class=\"legend\">";
    for ((class, meaning), count) in KINDS.iter().zip(counts).filter(|(_, count)| *count > 0) {
        out += &format!(
            "<span class=\"key\"><svg aria-hidden=\"true\" viewBox=\"0 0 14 14\" width=\"14\" height=\"14\"><rect class=\"{class}\" width=\"14\" \
             height=\"14\"/></svg>{meaning} ({count})</span>"
        );
    }
    out + "</p></figure>\n"
}
