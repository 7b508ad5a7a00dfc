//! Renders a real KITTI drive in synthetic scenery: `reenact POSES LABELS FRAMES FOLDER`.

use std::path::Path;

use motorcade_dataset::{read_labels, read_trajectory};
use motorcade_geometry::{Camera, World};
use motorcade_simulate::{ReenactOptions, RenderOptions, WriteOptions, reenact};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [poses, labels, frames, folder] = arguments.as_slice() else {
        return Err("usage: reenact POSES LABELS FRAMES FOLDER".into());
    };
    let mut trajectory = read_trajectory::<World, Camera>(Path::new(poses))?.poses;
    trajectory.truncate(frames.parse()?);
    let labels = read_labels(Path::new(labels))?;
    let (options, render) = (ReenactOptions::default(), RenderOptions::default());
    let drive = reenact("reenacted", &trajectory, &labels, &options, &render)?;
    drive.write_kitti(Path::new(folder), &WriteOptions::default(), &|_| {})?;
    Ok(())
}
