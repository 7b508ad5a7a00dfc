//! Tests of checkpoints.

use super::*;
use crate::detection::{BoundingBox, BoxConvention, Detection, VehicleClass};
use crate::detectors::VehicleDetector;
use crate::perception::Perception;

/// Counts the frames it is asked for.
struct Counter(Arc<Mutex<Vec<u64>>>);

impl VehicleDetector for Counter {
    fn detect(&mut self, frame: &Frame) -> Result<Vec<Detection>> {
        self.0.lock().unwrap().push(frame.number);
        let x = frame.number as f64 / 3.0;
        Ok(vec![Detection {
            class: VehicleClass::Car,
            score: 0.1 + 0.2,
            bbox: BoundingBox::new([x, 1.0, x + 20.0, 30.0]),
            convention: BoxConvention::VisibleExtent,
            external_id: None,
            pixel_size: 1.0,
            road_below: None,
        }])
    }
    fn description(&self) -> String {
        "a counter".into()
    }
}

fn frame(number: u64) -> Frame {
    let image = image::GrayImage::from_fn(40, 30, |x, y| image::Luma([(x * y + number as u32) as u8]));
    Frame { number, ..Frame::from_gray(image, number as i64) }
}

fn run(settings: &str) -> Identity {
    vec![("version".into(), "1".into()), ("settings".into(), settings.into())]
}

/// Observes frames; those that the detector saw, and all output.
fn observe(checkpoint: Checkpoint, frames: std::ops::Range<u64>) -> Result<(Vec<u64>, Vec<Observations>)> {
    let seen = Arc::new(Mutex::new(Vec::new()));
    let mut perception = Perception::none().with_detector(Counter(Arc::clone(&seen)));
    perception.save_in(checkpoint);
    let all = frames.map(|number| perception.observe(&frame(number))).collect::<Result<_>>()?;
    let seen = seen.lock().unwrap().clone();
    Ok((seen, all))
}

#[test]
fn a_stopped_run_goes_on_wherever_its_file_ends() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint");
    assert!(Checkpoint::resume(&path, run("a")).unwrap().is_none());
    let (seen, expected) = observe(Checkpoint::create(&path, run("a")).unwrap(), 0..6).unwrap();
    assert_eq!(seen, [0, 1, 2, 3, 4, 5]);
    let whole = fs::read(&path).unwrap();
    for end in (0..=whole.len()).step_by(13).chain([whole.len()]) {
        fs::write(&path, &whole[..end]).unwrap();
        let lines = whole[..end].iter().filter(|b| **b == b'\n').count().saturating_sub(1);
        let checkpoint = Checkpoint::resume(&path, run("a")).unwrap().unwrap();
        let (seen, all) = observe(checkpoint.clone(), 0..6).unwrap();
        assert_eq!((seen.len(), checkpoint.replayed()), (6 - lines, lines), "{end}");
        assert!(all == expected && fs::read(&path).unwrap() == whole, "{end}");
    }
    // A line that is damaged, and all after it, are made again.
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] = b'\x01';
    fs::write(&path, &damaged).unwrap();
    let checkpoint = Checkpoint::resume(&path, run("a")).unwrap().unwrap();
    assert_eq!(observe(checkpoint.clone(), 0..6).unwrap().1, expected);
    assert_eq!(fs::read(&path).unwrap(), whole);
    checkpoint.remove();
    assert!(!path.exists());
}

#[test]
fn frames_before_a_state_are_passed_over_or_nothing_is_changed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint");
    let (_, expected) = observe(Checkpoint::create(&path, run("a")).unwrap(), 0..6).unwrap();
    let skipped = |number, observed| SkippedFrame { number, timestamp_ns: number as i64, observed };
    // Frame 3 is in the file, though its row says that it repeats the one before; 40 did not read.
    let frames = [(0, true), (1, true), (2, true), (40, false), (3, false)].map(|(n, o)| skipped(n, o));
    let checkpoint = Checkpoint::resume(&path, run("a")).unwrap().unwrap();
    let seen = Arc::new(Mutex::new(Vec::new()));
    let mut perception = Perception::none().with_detector(Counter(Arc::clone(&seen)));
    let kept = perception.keep();
    perception.save_in(checkpoint);
    assert!(perception.skip(&[skipped(0, true), skipped(7, true), skipped(1, true)]).is_err());
    perception.skip(&frames).unwrap();
    let rest: Vec<_> = (4..7).map(|number| perception.observe(&frame(number)).unwrap()).collect();
    assert_eq!((&rest[..2], seen.lock().unwrap().as_slice()), (&expected[4..], &[6][..]));
    let mut whole = Perception::none().with_detector(Counter(Arc::clone(&seen)));
    let expected = whole.keep();
    (0..7).for_each(|number| drop(whole.observe(&frame(number)).unwrap()));
    assert_eq!(kept.text(), expected.text());
}

#[test]
fn lines_are_forced_onto_the_disk_as_often_as_set() {
    let folder = tempfile::tempdir().unwrap();
    for (every, forced) in
        [(Duration::ZERO, true), (Duration::from_secs(3600), false), (Duration::MAX, false)]
    {
        let checkpoint = Checkpoint::create(&folder.path().join("checkpoint"), run("a")).unwrap();
        checkpoint.sync_every(every);
        let begun = checkpoint.state().synced;
        observe(checkpoint.clone(), 0..2).unwrap();
        assert_eq!(checkpoint.state().synced > begun, forced, "{every:?}");
    }
}

#[test]
fn what_is_no_checkpoint_of_this_run_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint");
    let says = |made: Result<Option<Checkpoint>>, words: &str| {
        let error = made.unwrap_err().to_string();
        assert!(error.contains("checkpoint") && error.contains(words), "{error}");
    };
    let first = Checkpoint::create(&path, run("a")).unwrap();
    says(Checkpoint::create(&path, run("a")).map(Some), "another run is writing");
    observe(first, 0..2).unwrap();
    says(Checkpoint::resume(&path, run("b")), "another settings (a, now b)");
    let resumed = Checkpoint::resume(&path, run("a")).unwrap().unwrap();
    let error = observe(resumed, 1..3).unwrap_err().to_string();
    assert!(error.contains("frame 1 is not the picture"), "{error}");
    fs::write(&path, "frame,x1\n").unwrap();
    says(Checkpoint::resume(&path, run("a")), "line 1");
    #[cfg(unix)]
    {
        let link = folder.path().join("link-to-a-checkpoint");
        std::os::unix::fs::symlink(folder.path().join("mine"), &link).unwrap();
        says(Checkpoint::create(&link, run("a")).map(Some), "symbolic link");
        assert!(!folder.path().join("mine").exists());
    }
}
