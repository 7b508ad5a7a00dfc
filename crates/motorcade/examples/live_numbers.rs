//! Live numbers from a video: own speed, distance and speed of the vehicle ahead.
//! `cargo run --release --example live_numbers -- drive.mp4 camera.toml HEIGHT_M [MODELS_FOLDER]`.

#![allow(clippy::print_stdout, reason = "an example talks")]

use motorcade::dataset::{Sequence, SequenceOptions};
use motorcade::perception::{ModelSource, Perception, PerceptionOptions};
use motorcade::{Estimate, Motorcade, VehicleEstimate};

/// Distance along the own lane \[m\], and the vehicle.
fn ahead(now: &Estimate) -> Option<(f64, &VehicleEstimate)> {
    let in_camera = |v: &VehicleEstimate| {
        (now.ego.world_from_camera.inverse() * v.state.world_from_vehicle).translation()
    };
    let own_lane =
        now.vehicles.iter().map(|v| (in_camera(v), v)).filter(|(t, _)| t.z > 0.0 && t.x.abs() < 1.8);
    own_lane.map(|(t, v)| (t.z, v)).min_by(|a, b| a.0.total_cmp(&b.0))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [video, calibration, height_m, models @ ..] = arguments.as_slice() else {
        return Err("expected VIDEO CALIBRATION HEIGHT_M [MODELS_FOLDER]".into());
    };
    let options = SequenceOptions { calibration: Some(calibration.into()), ..Default::default() };
    let sequence = Sequence::open(video.as_ref(), &options)?;
    let models = models.first().map_or(ModelSource::Embedded, |folder| ModelSource::Folder(folder.into()));
    let perception = Perception::open(&PerceptionOptions { models, ..Default::default() }, sequence.size())?;
    let builder = Motorcade::builder(sequence.camera()?).height_m(height_m.parse()?).perception(perception);
    let mut slam = builder.build()?;
    for frame in sequence.frames() {
        let frame = match frame {
            Ok(frame) => frame,
            Err(bad) => {
                slam.skip(bad.number, bad.timestamp_ns, &bad.reason.to_string())?;
                continue;
            }
        };
        let now = slam.step(&frame)?;
        print!("{:8.2} s {:6.1} km/h", frame.timestamp_ns as f64 * 1e-9, 3.6 * now.speed_mps);
        match ahead(&now) {
            Some((distance_m, vehicle)) => println!(
                "   vehicle {} {distance_m:.1} m ahead, {:.1} ± {:.1} km/h",
                vehicle.id,
                3.6 * vehicle.state.speed_mps,
                3.6 * vehicle.state.speed_sigma_mps
            ),
            None => println!(),
        }
    }
    Ok(())
}
