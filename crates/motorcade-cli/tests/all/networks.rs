//! Networks that are not what `models.toml` says: the file is named, code 3, and nothing is written.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use std::fs;

use crate::common::{Answer, drive, nothing_written, run};
use motorcade_testing::onnx;
use tempfile::TempDir;

const DETECTOR: &str = r#"{ kind = "yolox", classes = { 2 = "Car" } }"#;
const ROAD: &str = r#"{ kind = "segmentation", road = [7] }"#;

/// A drive, and beside it `models/` with one network.
fn folder(network: &[u8], input: &str, output: &str) -> TempDir {
    let folder = drive(3);
    let models = folder.path().join("models");
    fs::create_dir(&models).unwrap();
    fs::write(models.join("tiny.onnx"), network).unwrap();
    let manifest = format!(
        "[[model]]\nname = \"tiny\"\nfile = \"tiny.onnx\"\nlicence = \"MIT\"\n\
         input = {{ colour = \"rgb\", resize = \"stretch\"{input} }}\noutput = {output}\n"
    );
    fs::write(models.join("models.toml"), manifest).unwrap();
    folder
}

/// Runs with that network.
fn with(inputs: &[&[u64]], input: &str, output: &str) -> (TempDir, Answer) {
    let folder = folder(&onnx::network(inputs), input, output);
    let result = run(folder.path(), "--models models");
    (folder, result)
}

#[track_caller]
fn refused(inputs: &[&[u64]], input: &str, output: &str, said: &[&str]) {
    let (folder, result) = with(inputs, input, output);
    result.expect(3, &[&["tiny.onnx"], said].concat());
    nothing_written(folder.path());
}

#[test]
fn an_input_that_is_no_image() {
    refused(&[&[1, 10]], "", DETECTOR, &["[1, 10]", "expected [1, 3, height, width]"]);
    refused(&[&[1, 1, 32, 32]], "", DETECTOR, &["[1, 1, 32, 32]", "expected [1, 3, height, width]"]);
    refused(&[&[4, 3, 32, 32]], "", ROAD, &["[4, 3, 32, 32]", "expected [1, 3, height, width]"]);
}

#[test]
fn more_than_one_input() {
    refused(&[&[1, 3, 32, 32], &[1, 2]], "", DETECTOR, &["2 inputs", "expected one image"]);
}

#[test]
fn another_size_than_the_manifest_says() {
    let size = ", size = [64, 32]";
    refused(&[&[1, 3, 32, 32]], size, DETECTOR, &["[1, 3, 32, 32]", "expected [1, 3, 64, 32]"]);
}

/// It loads, and only what comes out shows that it is something else.
#[test]
fn an_output_of_another_kind() {
    refused(&[&[1, 3, 32, 32]], "", DETECTOR, &["output has shape [1, 3, 32, 32]", "manifest"]);
    refused(&[&[1, 3, 32, 32]], "", ROAD, &["output has shape [1, 3, 32, 32]", "8 or more"]);
}

#[test]
fn a_network_cut_short() {
    let whole = onnx::network(&[&[1, 3, 32, 32]]);
    let folder = folder(&whole[..whole.len() / 2], "", DETECTOR);
    run(folder.path(), "--models models").expect(3, &["tiny.onnx"]);
    nothing_written(folder.path());
}

/// The tiny network itself is sound: described rightly it runs.
#[test]
fn the_same_network_described_rightly() {
    let (_folder, result) = with(&[&[1, 3, 32, 32]], "", r#"{ kind = "segmentation", road = [1] }"#);
    assert_ne!(result.code, 3, "{}", result.stderr);
    assert!(!result.stderr.contains("tiny.onnx"), "{}", result.stderr);
}

/// The engine itself is missing: not the fault of the input, and the message says what to do.
#[cfg(feature = "ort")]
#[test]
fn no_onnx_runtime() {
    let folder = folder(&onnx::network(&[&[1, 3, 32, 32]]), "", DETECTOR);
    let arguments = "run frames --calibration camera.toml --height 1.5 --out out --models models";
    let mut command = crate::common::program(folder.path(), arguments);
    let result: Answer = command.env("ORT_DYLIB_PATH", "/nowhere/libonnxruntime.so").output().unwrap().into();
    result.expect(5, &["/nowhere/libonnxruntime.so", "pip install onnxruntime", "ORT_DYLIB_PATH"]);
    nothing_written(folder.path());
}

#[test]
fn networks_that_ask_for_more_memory_than_there_is() {
    for (shape, said) in [
        // 12 TB, which no machine gives, and 6 GB, which many would give and fill.
        ([1, 3, 1_000_000, 1_000_000], "asks for 3000000000000 elements"),
        ([1, 3, 23_000, 23_000], "asks for 1587000000 elements"),
    ] {
        let folder = folder(&onnx::hungry(&shape), "", ROAD);
        let start = std::time::Instant::now();
        let result = run(folder.path(), "--models models");
        assert!(start.elapsed().as_secs() < 15, "{:?}", start.elapsed());
        result.expect(3, &["tiny.onnx", said]);
        nothing_written(folder.path());
    }
    // The same graph with a size that fits is refused for its output alone.
    let folder = folder(&onnx::hungry(&[1, 3, 32, 32]), "", DETECTOR);
    run(folder.path(), "--models models").expect(3, &["tiny.onnx", "output has shape"]);
}

#[test]
fn an_input_larger_than_any_picture() {
    refused(&[&[1, 3, 10_000_000_000, 10_000_000_000]], "", ROAD, &["8192 px a side"]);
    refused(&[&[1, 3, 0, 32]], "", ROAD, &["8192 px a side"]);
}

/// Declared in the file, or known when the network runs: a second of the processor and 200 MB, all processes together.
#[cfg(target_os = "linux")]
#[test]
fn networks_that_ask_for_terabytes_take_little_time_and_memory() {
    for (network, said) in [
        (onnx::hungry(&[1, 3, 1_000_000, 1_000_000]), "asks for 3000000000000 elements"),
        (onnx::tiled(&[1, 1, 100_000, 100_000]), "asks for 10000000000 elements or more"),
        (onnx::tiled(&[1, 1, 10_000, 10_000]), "asking for more memory than there is"),
    ] {
        let folder = folder(&network, "", ROAD);
        let usual = "run frames --calibration camera.toml --height 1.5 --out out --models models";
        let cost = crate::common::cost::cost(folder.path(), usual);
        cost.at_most_a_second().expect(3, &["tiny.onnx", said]);
        assert!(cost.peak_kb < 200 << 10, "{said}: {} kB", cost.peak_kb);
        nothing_written(folder.path());
    }
    // The same graph with a size that fits is refused for its output alone.
    let folder = folder(&onnx::tiled(&[1, 1, 2, 2]), "", DETECTOR);
    run(folder.path(), "--models models").expect(3, &["tiny.onnx", "output has shape [1, 3, 64, 64]"]);
}
