//! `motorcade inspect`.

use motorcade::{RepeatedFrameOptions, RepeatedPictures, repeated_pictures};
use motorcade_dataset::{LensSummary, Sequence, Summary};
use serde_json::json;

use crate::arguments::InspectArguments;
use crate::exit;

/// Prints what an input is recognised as.
pub fn inspect(arguments: &InspectArguments) -> anyhow::Result<u8> {
    let sequence = Sequence::open(&arguments.input.input, &arguments.input.options())?;
    let summary = sequence.summary();
    let pictures = repeated_pictures(&sequence, arguments.compare, &RepeatedFrameOptions::default());
    exit::print(&if arguments.json {
        let mut value = serde_json::to_value(&summary)?;
        let RepeatedPictures { looked_at, repeated, frozen } = pictures;
        value["pictures"] = json!({ "looked_at": looked_at, "repeated": repeated, "frozen": frozen });
        serde_json::to_string_pretty(&value)?
    } else {
        table(&summary, &pictures)
    })?;
    Ok(exit::FINE)
}

fn table(s: &Summary, pictures: &RepeatedPictures) -> String {
    let mut rows = vec![
        ("format", s.format.name().to_owned()),
        ("frames", format!("{} (numbers {} to {})", s.frames, s.numbers.0, s.numbers.1)),
        ("duration", format!("{:.1} s", s.duration_s)),
        ("rate", rate(s)),
        ("size", format!("{}x{} px, {}", s.width, s.height, if s.colour { "colour" } else { "grey" })),
        ("aspect", format!("{:.3}, pixels taken for square", f64::from(s.width) / f64::from(s.height))),
        ("rotation", rotation(s)),
        ("repeated", repeated(pictures)),
    ];
    if let Some(sequence) = &s.sequence {
        rows.push(("sequence", sequence.clone()));
    }
    if let Some(camera) = s.camera {
        rows.push(("camera", camera.to_string()));
    }
    match (s.calibration, s.intrinsics_px) {
        (Some(kind), Some(undistorted)) => {
            let of_input = s.lens.as_ref().map_or(undistorted, |lens| lens.intrinsics_px);
            rows.push(("calibration", format!("{kind}: {}", intrinsics(&of_input))));
            rows.extend(distortion(s));
            rows.extend(s.lens.as_ref().map(|lens| ("pinhole", pinhole(lens, &undistorted))));
        }
        _ => rows.push(("calibration", "none: give --calibration FILE to run".to_owned())),
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

/// Turn of the pictures by a container. Pictures whose EXIF data ask for one are refused.
fn rotation(s: &Summary) -> String {
    match s.rotation_deg {
        None => "none".to_owned(),
        Some(turn) => {
            let turn = turn.rem_euclid(360);
            format!("{turn} degrees to the left by the container, applied: calibrate the turned frames")
        }
    }
}

/// Pictures that show the one before again.
fn repeated(RepeatedPictures { looked_at, repeated, frozen }: &RepeatedPictures) -> String {
    let frozen = if *frozen > 0 { format!(", {frozen} frozen") } else { String::new() };
    format!("{repeated} of the first {looked_at} pictures show the one before again{frozen}")
}

fn intrinsics([fx, fy, cx, cy]: &[f64; 4]) -> String {
    format!("fx {fx:.2} fy {fy:.2} cx {cx:.2} cy {cy:.2} px")
}

/// Coefficients by name.
fn distortion(s: &Summary) -> Option<(&'static str, String)> {
    let values = s.distortion.as_ref()?;
    let model = s.lens.as_ref().map_or("radial-tangential", |lens| lens.model);
    let names: &[&str] = match model {
        "fisheye" => &["k1", "k2", "k3", "k4"],
        _ => &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"],
    };
    let pairs: Vec<String> =
        names.iter().zip(values).map(|(name, value)| format!("{name} {value}")).collect();
    let named = if s.lens.is_some() { format!("{model} ") } else { String::new() };
    Some(("distortion", format!("{named}{} (undistorted on input)", pairs.join(" "))))
}

/// The camera of the undistorted frames.
fn pinhole(lens: &LensSummary, undistorted: &[f64; 4]) -> String {
    let (horizontal, vertical) = lens.view_deg;
    format!(
        "{}, view {horizontal:.1} x {vertical:.1} degrees (of the undistorted frames)",
        intrinsics(undistorted)
    )
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
