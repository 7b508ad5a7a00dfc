//! Against the published priors of `shape_prior`, when they are there.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)] // helpers of tests

use motorcade_shape::{ConvertOptions, Layout, ShapePrior, command, convert};

/// Our mean, scaled to a car of 4.1 m, and the published one agree after a similarity alignment.
#[test]
fn our_mean_lies_close_to_the_published_one() {
    let Some(folder) = motorcade_testing::shared("shape_prior") else { return };
    for (layout, tables, bound_m) in [
        (Layout::Car36, ["mean_36.txt", "basis_36.txt"], 0.12),
        (Layout::Car14, ["mean_14.txt", "basis_14.txt"], 0.15),
    ] {
        let [mean, basis] = tables.map(|name| folder.join(name));
        let published = convert(&mean, &basis, &ConvertOptions::new(layout)).unwrap();
        let own = ShapePrior::of_family(layout);
        let own_length_m = own.dimensions(&[]).length_m;
        let rms_m = own.rms_to(published.mean()).unwrap() * 4.1 / own_length_m;
        println!("{layout:?}: RMS {rms_m:.3} m at 4.1 m (own mean {own_length_m:.2} m long)");
        assert!(rms_m <= bound_m, "{layout:?}: {rms_m}");
        assert_eq!(published.basis().len(), if layout == Layout::Car36 { 42 } else { 5 });
    }
}

#[test]
fn the_converted_file_reads_back() {
    let Some(folder) = motorcade_testing::shared("shape_prior") else { return };
    let output = tempfile::tempdir().unwrap();
    let request = command::ConvertRequest {
        mean: folder.join("mean_36.txt"),
        basis: folder.join("basis_36.txt"),
        output: output.path().join("car.json"),
        options: ConvertOptions::new(Layout::Car36),
    };
    let (report, text) = command::convert(&request).unwrap();
    std::fs::write(&request.output, text).unwrap();
    assert_eq!((report.keypoints, report.deformations), (36, 42));
    assert!(report.mean_size.length_m > 3.9 && report.mean_size.length_m < 4.2, "{report:?}");
    let info = command::info(&request.output).unwrap();
    assert!(info.rms_to_own_m.unwrap() < 0.13 && info.name == report.name);
}
