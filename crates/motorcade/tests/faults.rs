//! Detectors that panic: the results hold the frames before, whatever the number of threads.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

use motorcade::dataset::{Frame, Sequence, SequenceOptions};
use motorcade::perception::{Detection, Error, VehicleDetector};
use motorcade::{Motorcade, NoProgress, push_sequence};
use motorcade_testing::street_image::{CAMERA, StreetPose, street_image};

/// Fails by a fault of its own at one frame.
struct Faulty(u64);

impl VehicleDetector for Faulty {
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>, Error> {
        assert!(frame.number != self.0, "an index out of range");
        Ok(Vec::new())
    }
    fn description(&self) -> String {
        "a detector with a fault".into()
    }
}

#[test]
fn a_worker_that_panics_ends_the_frames_and_not_the_results() {
    let folder = tempfile::tempdir().unwrap();
    for k in 0..10 {
        let image = street_image(&CAMERA, &StreetPose::along(f64::from(k)));
        image.save(folder.path().join(format!("{k:06}.png"))).unwrap();
    }
    let sequence = Sequence::open(folder.path(), &SequenceOptions::default()).unwrap();
    let mut poses = Vec::new();
    for threads in [1, 2, 4] {
        let mut slam = Motorcade::builder(CAMERA).height_m(1.5).detector(Faulty(7)).build().unwrap();
        push_sequence(&mut slam, &sequence, threads, &NoProgress, &mut |_, _| {}).unwrap();
        let result = slam.finish();
        assert!(result.failed && result.interrupted && result.ego.frames.len() == 7, "{threads} threads");
        let said = |words: &str| result.warnings.iter().any(|w| w.contains(words));
        assert!(said("frame 7: a fault of the program in its detectors (an index out of range)"));
        assert!(said("frames 0 to 6 of 10"), "{:?}", result.warnings);
        poses.push(format!("{:?}", result.ego.frames));
    }
    assert!(poses.iter().all(|p| *p == poses[0]));
}
