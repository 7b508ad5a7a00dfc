//! The development networks on the development drives (`MOTORCADE_SHARED`, default `../shared`), when they are there.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests may fail loudly too")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use motorcade_dataset::{Frame, Label, Sequence, SequenceOptions, read_labels};
use motorcade_perception::{
    Engine, Error, ModelOptions, ModelSet, ModelSource, Observations, Perception, PerceptionOptions,
};
use motorcade_testing::shared;

const KITTI: (u32, u32) = (1242, 375);

fn development_data() -> Option<PathBuf> {
    shared("models").and(shared("kitti")).and(shared("."))
}

fn drive(shared: &Path, stride: usize) -> Sequence {
    let options = SequenceOptions {
        sequence: Some("0005".into()),
        camera: Some(3),
        stride,
        ..SequenceOptions::default()
    };
    Sequence::open(&shared.join("kitti/tracking/training"), &options).unwrap()
}

fn perception(shared: &Path, threads: usize) -> Perception {
    let networks = ModelOptions { threads, engine: Engine::Rten, ..ModelOptions::default() };
    let options = PerceptionOptions {
        models: ModelSource::Folder(shared.join("models")),
        networks,
        ..PerceptionOptions::default()
    };
    Perception::open(&options, KITTI).unwrap()
}

/// A labelled car that a detector has to find.
fn is_clear(label: &Label, frame: &Frame) -> bool {
    label.frame == frame.number
        && ["Car", "Van"].contains(&label.class.as_str())
        && label.occluded == 0.0
        && label.truncated == 0.0
        && label.bbox.height() >= 40.0
}

#[test]
fn clear_cars_are_found_and_the_road_is_road() {
    let Some(shared) = development_data() else { return };
    let labels = read_labels(&shared.join("kitti/tracking/training/label_03/0005.txt")).unwrap();
    let mut perception = perception(&shared, 1);
    assert_eq!(perception.describe().0, "network yolox-nano-1248");
    assert_eq!(perception.describe().1, "network road-segmentation-adas-0001-832");
    let (mut wanted, mut found, mut frames, mut iou_sum) = (0, 0, 0, 0.0);
    let (mut road_on_cars, mut cars, mut seconds) = (0, 0, 0.0);
    for frame in drive(&shared, 10).frames().map(Result::unwrap) {
        let started = Instant::now();
        let Observations { detections, road, .. } = perception.observe(&frame).unwrap();
        seconds += started.elapsed().as_secs_f64();
        frames += 1;
        let road = road.unwrap();
        assert!(road.is_road(621.0, 320.0), "frame {}: asphalt before the car", frame.number);
        assert!(!road.is_road(621.0, 20.0), "frame {}: sky", frame.number);
        for label in labels.iter().filter(|label| is_clear(label, &frame)) {
            let best = detections
                .iter()
                .filter(|d| d.score >= 0.25)
                .map(|d| d.bbox.iou(&label.bbox))
                .fold(0.0, f64::max);
            wanted += 1;
            found += usize::from(best >= 0.5);
            iou_sum += if best >= 0.5 { best } else { 0.0 };
            let (x, y) = label.bbox.centre();
            cars += 1;
            road_on_cars += usize::from(road.is_road(x, y));
        }
    }
    println!(
        "0005: {found}/{wanted} clear cars found at IoU 0.5, mean IoU {:.3}; road mask on {road_on_cars}/{cars} car \
         centres; {:.0} ms a frame for both networks on one thread",
        iou_sum / f64::from(found as u32),
        1e3 * seconds / f64::from(frames)
    );
    assert!(wanted >= 20 && found * 100 >= wanted * 90, "{found} of {wanted} clear cars");
    assert!(road_on_cars * 10 <= cars, "{road_on_cars} of {cars} cars are called road");
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let Some(shared) = development_data() else { return };
    let frame = drive(&shared, 150).frames().nth(1).unwrap().unwrap();
    let one = perception(&shared, 1).observe(&frame).unwrap();
    assert!(!one.detections.is_empty());
    assert_eq!(one, perception(&shared, 2).observe(&frame).unwrap());
}

#[test]
fn a_network_of_another_kind_or_shape_is_refused() {
    let Some(shared) = development_data() else { return };
    let folder = tempfile::tempdir().unwrap();
    let onnx = shared.join("models/yolox_nano_416.onnx");
    std::fs::copy(onnx, folder.path().join("net.onnx")).unwrap();
    let load = |input: &str, extra: &str, output: &str| -> Result<ModelSet, Error> {
        let manifest = format!(
            "[[model]]\nname = \"net\"\nfile = \"net.onnx\"\nlicence = \"Apache-2.0\"\n{extra}\ninput = {{ colour = \"bgr\", \
             resize = \"letterbox\"{input} }}\noutput = {{ {output} }}\n"
        );
        std::fs::write(folder.path().join("models.toml"), manifest).unwrap();
        let options = ModelOptions { engine: Engine::Rten, ..ModelOptions::default() };
        ModelSet::load(folder.path(), KITTI, &options)
    };
    let cars = "kind = \"yolox\", classes = { 2 = \"Car\" }";
    let pixels = motorcade_dataset::Pixels::Rgb(image::RgbImage::new(1242, 375));
    let picture = Frame { index: 0, number: 0, timestamp_ns: 0, pixels, ignore: None };
    let good = load("", "", cars).unwrap();
    assert!(good.vehicles.unwrap().detect(&picture).unwrap().is_empty());
    let error = load(", size = [256, 256]", "", cars).unwrap_err();
    assert!(error.to_string().contains("[1, 3, 416, 416], expected [1, 3, 256, 256]"), "{error}");
    assert_eq!(error.exit_code(), 3);
    let error = load("", "sha256 = \"00\"", cars).unwrap_err();
    assert!(error.to_string().contains("SHA-256"), "{error}");
    let road = load("", "", "kind = \"segmentation\", road = [1]").unwrap();
    let error = road.road.unwrap().segment(&picture).unwrap_err();
    assert!(error.to_string().contains("net.onnx: output has shape [1, 3549, 85]"), "{error}");
    std::fs::write(folder.path().join("net.onnx"), b"not a network").unwrap();
    assert_eq!(load("", "", cars).unwrap_err().exit_code(), 3);
}
