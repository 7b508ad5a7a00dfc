//! Drives of many frames that are estimated as a whole: before the end memory does not grow with them, and the results are those of all their frames.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test")]
#![allow(unsafe_code, reason = "memory of a thread can be counted by a global allocator alone")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use crate::common::{CAMERA, HEIGHT_M, drive, pose};
use motorcade::dataset::Frame;
use motorcade::{External, ExternalTrajectory, Motorcade, NoProgress, RunResult};
use motorcade_perception::Observations;
use motorcade_testing::street_image::{self, HALF_CAMERA, StreetPose, street_image};

thread_local! {
    /// Bytes that this thread holds.
    static HELD: Cell<isize> = const { Cell::new(0) };
}

struct Counting;

impl Counting {
    fn add(bytes: usize) {
        HELD.with(|held| held.set(held.get() + bytes as isize));
    }
    fn remove(bytes: usize) {
        HELD.with(|held| held.set(held.get() - bytes as isize));
    }
}

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        Self::remove(layout.size());
        unsafe { System.dealloc(block, layout) }
    }
    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::remove(layout.size());
        Self::add(size);
        unsafe { System.realloc(block, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn memory_before_the_end_does_not_grow_with_the_frames() {
    const FRAMES: usize = 2400;
    let mut slam = Motorcade::builder(HALF_CAMERA).height_m(street_image::HEIGHT_M).build().unwrap();
    let mut held = Vec::with_capacity(FRAMES);
    for k in 0..FRAMES {
        let image = street_image(&HALF_CAMERA, &StreetPose::along(0.8 * k as f64));
        let frame = Frame { number: k as u64, ..Frame::from_gray(image, k as i64 * 100_000_000) };
        slam.push(&frame).unwrap();
        drop(frame);
        held.push(HELD.with(Cell::get));
    }
    let most = |rows: std::ops::Range<usize>| held[rows].iter().copied().max().unwrap();
    let (before, after) = (most(600..1200), most(1800..2400));
    let a_frame = (after - before) as f64 / 1200.0;
    println!("{before} to {after} bytes, {a_frame:.0} a frame");
    // Numbers and times of the frames, poses of the keyframes of the odometry: a tenth of a kilobyte.
    assert!(a_frame < 200.0, "{before} to {after} bytes, {a_frame:.0} a frame");
    let result = slam.finish();
    // What was put away came back.
    let tracked = result.tracked_share();
    assert!(result.ego.frames.len() == FRAMES && tracked > 0.95, "{tracked}");
    assert!(result.road_measurement_count > FRAMES / 2 && result.loops.keyframes > FRAMES / 6);
    assert_eq!(result.road_measurements.len(), result.road_measurement_count);
}

/// A drive along a given trajectory behind a car; `estimated` are the frames that are estimated as they come.
fn along(frames: usize, estimated: impl Fn(usize) -> bool) -> Motorcade {
    let record = drive(frames);
    let trajectory = ExternalTrajectory { world_from_camera: (0..frames).map(pose).collect(), metric: true };
    let external = External { trajectory: Some(trajectory), ..External::default() };
    let mut slam = Motorcade::builder(CAMERA).height_m(HEIGHT_M).external(external).build().unwrap();
    for (k, (frame, detections)) in record.frames.into_iter().zip(&record.detections).enumerate() {
        let observations = Observations { detections: detections.clone(), ..Observations::default() };
        slam.push_without_image(frame, observations).unwrap();
        if estimated(k) {
            assert!(slam.estimate().is_some());
        }
    }
    slam
}

/// All of a result that depends on what was put away, to the last bit.
fn written(result: &RunResult) -> String {
    assert!(!result.vehicles.is_empty());
    format!("{:?}{:?}{:?}{:?}", result.ego.frames, result.vehicles, result.detections, result.warnings)
}

#[test]
fn results_do_not_depend_on_when_frames_are_estimated() {
    // Two seconds more than it takes until rows are put away beside the longest window.
    const FRAMES: usize = 520;
    let patterns: [fn(usize) -> bool; 3] = [|_| false, |_| true, |k| k == 450];
    let whole = patterns.map(|estimated| written(&along(FRAMES, estimated).finish()));
    assert!(whole.iter().all(|text| *text == whole[0]));
    let online = patterns.map(|estimated| written(&along(FRAMES, estimated).finish_online(&NoProgress)));
    assert!(online.iter().all(|text| *text == online[0]) && online[0] != whole[0]);
}
