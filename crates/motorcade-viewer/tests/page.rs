//! A page of a run made by hand.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use motorcade::{Config, Silent};
use motorcade_dataset::{Sequence, SequenceOptions};
use motorcade_perception::Perception;

const HOSTILE: &str = "</pre><script>alert('x')</script>";

/// A run on three grey frames: nothing is tracked, and the page must still be one.
fn page(warning: Option<&str>) -> String {
    let folder = tempfile::tempdir().unwrap();
    for k in 0..3 {
        image::GrayImage::new(64, 48).save(folder.path().join(format!("{k}.png"))).unwrap();
    }
    let calibration = "fx = 50.0\nfy = 50.0\ncx = 31.5\ncy = 23.5\nfps = 10.0\n";
    std::fs::write(folder.path().join("calibration.toml"), calibration).unwrap();
    let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
    let config = Config::default();
    let mut result = motorcade::run(
        &sequence,
        &Perception::none(),
        &motorcade::Given::default(),
        1.5,
        &config,
        1,
        &Silent,
    )
    .unwrap();
    result.warnings.extend(warning.map(str::to_owned));
    // Times differ from run to run; the page must not.
    result.stopwatch = motorcade::Stopwatch::default();
    let context = motorcade::RunContext {
        config,
        camera_from_cam0: sequence.camera_from_cam0(),
        input: motorcade_dataset::Summary { input_hash: "0".into(), ..sequence.summary() },
        perception: (HOSTILE.into(), "geometry".into()),
        command: vec!["motorcade".into(), HOSTILE.into()],
        fingerprint: "0".into(),
    };
    motorcade_viewer::report(&result, &context, None)
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    assert_eq!(page(None), page(None));
}

#[test]
fn text_stays_text() {
    let page = page(Some(HOSTILE));
    assert!(!page.contains("alert('x')"));
    assert_eq!(page.matches("<script>").count(), 1, "the page's own");
    assert_eq!(page.matches("&lt;script&gt;").count(), 3, "warning, command, source of vehicles");
}

#[test]
fn a_drive_without_motion_still_has_a_map() {
    let page = page(None);
    assert!(page.contains("class=\"map\"") && page.contains("No vehicles were looked for"));
    assert!(page.contains("filled in: before the map began (3)"));
    assert!(!page.contains("NaN"));
    for tag in ["section", "svg", "figure", "table", "g", "p"] {
        let (opened, closed) = (
            page.matches(&format!("<{tag}>")).count() + page.matches(&format!("<{tag} ")).count(),
            page.matches(&format!("</{tag}>")).count(),
        );
        assert_eq!(opened, closed, "{tag}");
    }
}
