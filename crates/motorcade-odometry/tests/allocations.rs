//! Once warm, a frame that becomes no keyframe allocates nothing but the lists of results.

#![allow(unsafe_code, reason = "a global allocator can be counted in no other way")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use motorcade_geometry::BoundingBox;
use motorcade_odometry::{
    Odometry, OdometryOptions, RoadFeedback, RoadInput, RoadOptions, RoadTracker, StaticMask,
};
use motorcade_testing::street_image::{CAMERA, StreetPose, street_image};

thread_local! {
    /// Allocations of this thread, reallocations included.
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

/// Distance between two frames \[m\]: walking pace at 5 frames a second, so that most frames become no keyframe.
const STEP_M: f64 = 0.3;
const FRAMES: usize = 60;
/// Until then the map is initialised, the plane is found and the road's history of 15 images is filled.
const WARM: usize = 25;

/// Allocations of every frame of a drive, and true for keyframes.
fn drive(boxes: &[BoundingBox]) -> Vec<(usize, bool)> {
    let mask = StaticMask { boxes, boxes_may_stand: true, ..StaticMask::default() };
    let mut odometry = Odometry::new(CAMERA, OdometryOptions::default());
    let mut road = RoadTracker::new(CAMERA, RoadOptions::default());
    let mut keyframes = 0;
    let mut one = |frame: usize| {
        let image = street_image(&CAMERA, &StreetPose::along(STEP_M * frame as f64));
        let before = TAKEN.with(Cell::get);
        let timestamp_ns = frame as i64 * 100_000_000;
        let pyramid = odometry.process(timestamp_ns, &image, &mask);
        let trajectory = odometry.trajectory();
        let segment = trajectory.frames[frame].segment;
        let input =
            RoadInput { frame, timestamp_ns, segment, pyramid: &pyramid, vehicles: &[], masked: false };
        let measured = road.process(&input, |k| trajectory.measured_pose(k), |_| true);
        let plane = road.plane();
        odometry.apply_road(&RoadFeedback { measurement: measured.as_ref(), plane, vehicles: boxes });
        let taken = TAKEN.with(Cell::get) - before;
        let keyframes_then =
            std::mem::replace(&mut keyframes, odometry.trajectory().keyframes.concat().len());
        (taken, keyframes > keyframes_then)
    };
    let taken = (0..FRAMES).map(&mut one).collect();
    assert!(road.measurements().len() > FRAMES / 2, "the road was not followed");
    assert!(boxes.is_empty() || odometry.landmarks().iter().any(|l| l.is_on_vehicle()));
    taken
}

#[test]
fn a_warm_frame_allocates_nothing() {
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
