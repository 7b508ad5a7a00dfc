//! `motorcade inspect`.

use motorcade_dataset::{Sequence, Summary};

use crate::arguments::InspectArguments;
use crate::exit;

/// Prints what an input is recognised as.
pub fn inspect(arguments: &InspectArguments) -> anyhow::Result<u8> {
    let sequence = Sequence::open(&arguments.input.input, &arguments.input.options())?;
    let summary = sequence.summary();
    exit::print(&if arguments.json { serde_json::to_string_pretty(&summary)? } else { table(&summary) })?;
    Ok(exit::FINE)
}

fn table(s: &Summary) -> String {
    let mut rows = vec![
        ("format", s.format.name().to_owned()),
        ("frames", format!("{} (numbers {} to {})", s.frames, s.numbers.0, s.numbers.1)),
        ("duration", format!("{:.1} s", s.duration_s)),
        ("rate", rate(s)),
        ("size", format!("{}x{} px, {}", s.width, s.height, if s.colour { "colour" } else { "grey" })),
    ];
    if let Some(sequence) = &s.sequence {
        rows.push(("sequence", sequence.clone()));
    }
    if let Some(camera) = s.camera {
        rows.push(("camera", camera.to_string()));
    }
    match (s.calibration, s.intrinsics_px) {
        (Some(kind), Some([fx, fy, cx, cy])) => {
            rows.push(("calibration", format!("{kind}: fx {fx:.2} fy {fy:.2} cx {cx:.2} cy {cy:.2} px")));
        }
        _ => rows.push(("calibration", "none: give --calibration FILE to run".to_owned())),
    }
    if let Some(d) = s.distortion {
        rows.push((
            "distortion",
            format!("k1 {} k2 {} p1 {} p2 {} k3 {} (undistorted on input)", d[0], d[1], d[2], d[3], d[4]),
        ));
    }
    let list = |numbers: &[u64]| numbers.iter().map(u64::to_string).collect::<Vec<_>>().join(", ");
    rows.push(("gaps", if s.gaps.is_empty() { "none".to_owned() } else { list(&s.gaps) }));
    for (name, files) in [("duplicates", &s.duplicates), ("left out", &s.unnumbered)] {
        if !files.is_empty() {
            rows.push((name, files.join(", ")));
        }
    }
    rows.push(("hash", s.input_hash.clone()));
    rows.iter().map(|(k, v)| format!("{k:<12} {v}")).collect::<Vec<_>>().join("\n")
}

/// Frames a second, and how much the intervals between them vary.
fn rate(s: &Summary) -> String {
    let (shortest, longest) = s.intervals_s;
    if let Some(rate) = s.assumed_fps {
        return format!("{rate:.3} frames/s, assumed: give --fps");
    }
    let rate = if s.interval_s > 0.0 { 1.0 / s.interval_s } else { 0.0 };
    // Times are rounded to the ticks of a container.
    if longest - shortest < 0.02 * s.interval_s {
        format!("{rate:.3} frames/s")
    } else {
        format!("{rate:.3} frames/s in the middle, intervals from {shortest:.3} to {longest:.3} s")
    }
}
