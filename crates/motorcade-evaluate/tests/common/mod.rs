//! A drive past seven vehicles, in KITTI's format, and a run that finds most of them.

use std::path::Path;

use motorcade_dataset::{Label, write_kitti};
use motorcade_geometry::{BoundingBox, Camera, Pose, World};
use nalgebra::{UnitQuaternion, Vector3};

pub const FRAMES: u64 = 40;

/// A number between −1 and 1 that differs from vehicle to vehicle and frame to frame.
fn wave(a: u64, b: i64, rate: f64) -> f64 {
    (rate * a as f64 + 2.4 * rate * rate * b as f64 + 0.7 * b as f64).sin()
}

/// Vehicle `track` in a frame as labelled (`noise` 0) or as estimated.
fn vehicle(frame: u64, track: i64, noise: f64) -> Label {
    let s = frame as f64;
    let depth = 9.0 + 5.5 * track as f64 + 0.2 * s;
    let off = noise * wave(frame, track, 0.37);
    let (x, z) = (-6.0 + 2.3 * track as f64, depth * (1.0 + 0.015 * off) + 0.25 * off);
    let (u, v) = (600.0 + 700.0 * x / depth, 170.0 + 1155.0 / depth);
    let (half, tall) = (600.0 / depth, 1060.0 / depth);
    let class = match track {
        3 => "Van",
        _ => "Car",
    };
    Label {
        frame,
        track,
        class: class.into(),
        truncated: if track == 1 && noise == 0.0 { 0.2 } else { 0.0 },
        occluded: if noise == 0.0 { (frame as i64 + track).rem_euclid(4) as f64 } else { -1.0 },
        alpha_rad: 0.0,
        bbox: BoundingBox::new([u - half, v - tall, u + half, v].map(|edge| edge + 1.5 * off)),
        size_hwl_m: [1.5 + 0.1 * off, 1.65 + 0.15 * noise * wave(frame, track, 0.9), 4.0 - 0.3 * off],
        location_m: [x + 0.2 * noise * wave(frame, track, 1.3), 1.65 + 0.1 * off, z],
        ry_rad: 1.5 + 0.3 * track as f64 + 0.1 * off,
        score: (noise > 0.0).then(|| 0.5 + 0.45 * wave(frame, track, 2.1)),
    }
}

fn write(path: &Path, labels: impl Iterator<Item = Label>) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, labels.map(|label| label.to_line() + "\n").collect::<String>()).unwrap();
}

/// Writes sequence 0042 and the directory `run`.
pub fn make(root: &Path) {
    let camera = |s: u64| -> Pose<World, Camera> {
        Pose::from_parts(UnitQuaternion::identity(), Vector3::new(0.0, 0.0, s as f64))
    };
    for folder in ["calib", "gt_poses", "run"] {
        std::fs::create_dir_all(root.join(folder)).unwrap();
    }
    let calib = "P0: 700 0 600 0 0 700 170 0 0 0 1 0\nP2: 700 0 600 0 0 700 170 0 0 0 1 0\n";
    std::fs::write(root.join("calib/0042.txt"), calib).unwrap();
    let poses: Vec<_> = (0..FRAMES).map(camera).collect();
    for file in ["gt_poses/0042.txt", "run/ego.kitti.txt"] {
        write_kitti(std::fs::File::create(root.join(file)).unwrap(), &poses).unwrap();
    }
    let rows = || (0..FRAMES).flat_map(|frame| (0..7).map(move |track| (frame, track)));
    let ignored = |frame| Label { class: "DontCare".into(), track: -1, ..vehicle(frame, 6, 0.0) };
    let labelled = rows().filter(|(_, track)| *track < 6).map(|(f, t)| vehicle(f, t, 0.0));
    write(&root.join("label_02/0042.txt"), labelled.chain((0..FRAMES).map(ignored)));
    // One is never found, one is a van that is called a car, one stands where nothing is judged, one where nothing is.
    let found = rows().filter(|(_, track)| *track != 2).map(|(f, t)| vehicle(f, t, 1.0));
    let called = found.map(|label| Label { class: "Car".into(), ..label });
    let nothing = (0..FRAMES).step_by(3).map(|f| Label { track: 8, ..vehicle(f, -1, 1.0) });
    write(&root.join("run/tracks.kitti.txt"), called.chain(nothing));
}
