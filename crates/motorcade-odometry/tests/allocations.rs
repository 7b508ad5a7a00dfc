//! Once warm, a frame that becomes no keyframe takes no memory but for the lists of results.

#![allow(unsafe_code, reason = "a global allocator can be counted in no other way")]

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use common::{CAMERA, Place, street};
use motorcade_geometry::BoundingBox;
use motorcade_odometry::{Odometry, OdometryOptions, RoadInput, RoadOptions, RoadTracker, StaticMask};

thread_local! {
    /// Blocks this thread has asked for, growths included.
    static TAKEN: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        TAKEN.with(|t| t.set(t.get() + 1));
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        unsafe { System.dealloc(block, layout) }
    }
    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        TAKEN.with(|t| t.set(t.get() + 1));
        unsafe { System.realloc(block, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Way between two frames \[m\]: walking pace at 5 frames a second, so that most frames become no keyframe.
const STEP_M: f64 = 0.3;
const FRAMES: usize = 60;
/// Until then the map begins, the plane is found and the road's memory of earlier images, 15 of them, fills.
const WARM: usize = 25;

/// Blocks taken by every frame of a drive, and whether it became a keyframe.
fn drive(boxes: &[BoundingBox]) -> Vec<(usize, bool)> {
    let mask = StaticMask { boxes, boxes_may_stand: true, ignore: None };
    let mut odometry = Odometry::new(CAMERA, OdometryOptions::default());
    let mut road = RoadTracker::new(CAMERA, RoadOptions::default());
    let mut keyframes = 0;
    let mut one = |frame: usize| {
        let image = street(&CAMERA, &Place::along(STEP_M * frame as f64));
        let before = TAKEN.with(Cell::get);
        let pyramid = odometry.process(&image, &mask);
        let so_far = odometry.so_far();
        let segment = so_far.frames[frame].segment;
        let sight = RoadInput { pyramid: &pyramid, vehicles: &[], masked: false };
        road.process(frame, segment, &sight, |k| so_far.camera_from_world(k), |_| true);
        if let Some(measured) = road.measurements().last().filter(|m| m.frame == frame) {
            odometry.constrain_scale(measured);
        }
        if let Some(plane) = road.plane() {
            odometry.classify_static_vehicles(boxes, &plane);
        }
        let taken = TAKEN.with(Cell::get) - before;
        let keyframes_then = std::mem::replace(&mut keyframes, odometry.so_far().keyframes.concat().len());
        (taken, keyframes > keyframes_then)
    };
    let taken = (0..FRAMES).map(&mut one).collect();
    assert!(road.measurements().len() > FRAMES / 2, "the road was not followed");
    assert!(boxes.is_empty() || odometry.landmarks().iter().any(|l| l.on_vehicle.is_some()));
    taken
}

#[test]
fn a_warm_frame_takes_no_memory() {
    let parked = [
        BoundingBox { x1: 20.0, y1: 60.0, x2: 150.0, y2: 180.0 },
        BoundingBox { x1: 300.0, y1: 80.0, x2: 420.0, y2: 190.0 },
    ];
    for boxes in [&parked[..0], &parked[..]] {
        let frames = drive(boxes);
        let (keyframes, plain): (Vec<_>, Vec<_>) = frames[WARM..].iter().partition(|(_, keyframe)| *keyframe);
        // The counter counts: a keyframe has new corners and an adjustment to pay for.
        assert!(!keyframes.is_empty() && keyframes.iter().all(|(taken, _)| *taken > 100), "{frames:?}");
        // Two lists of results double, that of frames once and that of road measurements twice; so may the road's samples
        // when more of it shows than ever before.
        assert!(plain.len() > 25 && plain.iter().all(|(taken, _)| *taken <= 2), "{frames:?}");
        assert!(plain.iter().map(|(taken, _)| taken).sum::<usize>() <= 4, "{frames:?}");
    }
}
