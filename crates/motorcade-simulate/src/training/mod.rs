//! Labelled crops of vehicles to train a network on.
//!
//! A folder holds three NumPy arrays and a description of them:
//!
//! | file | element | shape | content |
//! |---|---|---|---|
//! | `crops.npy` | u8 | N × S × S × 3 | RGB crops, the box × margin stretched to S × S pixels |
//! | `keypoints.npy` | f32 | N × 36 × 2 | x, y of the `car-36` keypoints in the crop \[px\], pixel centres at integers |
//! | `sights.npy` | u8 | N × 36 | 0 seen, 1 on a side that faces away, 2 hidden by something else, 3 outside the picture, 4 no keypoints |
//! | `numbers.npy` | f32 | N × 25 | see `columns` in `crops.json` |
//!
//! Edges of boxes and of the picture are in the crop's pixels; the area beyond the picture's edges is rendered, too, and is
//! to be filled by the reader. Headings are relative to the ray through the middle of the box.

mod crop;
mod fleet;
mod jpeg;
mod npy;
mod sensor;
mod street;
#[cfg(test)]
mod tests;
mod viewpoint;

use std::fs;
use std::path::Path;
use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use self::crop::{COLUMNS, Crop, CropShape, KEYPOINTS};
use self::fleet::BODY_LABELS;
use self::npy::NpyWriter;
use self::street::Street;
use crate::error::{Error, Result};
use crate::hash;
use crate::render::{Renderer, Textures};

/// Streets rendered at a time.
const BATCH: u64 = 16;
/// Sets of textures that the streets share.
const TEXTURES: u64 = 6;

/// Number and size of the crops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleCropOptions {
    /// Number of crops.
    pub count: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Side \[px\].
    pub side_px: u32,
    /// Size of the crop relative to the box.
    pub margin: f64,
}

impl Default for VehicleCropOptions {
    fn default() -> Self {
        Self { count: 1000, seed: 1, side_px: 96, margin: 1.5 }
    }
}

impl VehicleCropOptions {
    fn validate(&self) -> Result<()> {
        if self.count == 0 {
            return Err(Error::Plan("at least one crop is needed".into()));
        }
        if !(16..=512).contains(&self.side_px) {
            return Err(Error::Plan(format!("crops must be 16 to 512 px wide, got {}", self.side_px)));
        }
        if !(1.0..=4.0).contains(&self.margin) {
            return Err(Error::Plan(format!("the margin must lie in [1, 4], got {}", self.margin)));
        }
        Ok(())
    }
}

/// Renders labelled crops into a folder; `advance` is called with their number so far. The same options give the same
/// bytes for any number of threads.
///
/// # Errors
/// Invalid options, or a folder that cannot be written.
pub fn write_vehicle_crops(options: &VehicleCropOptions, out: &Path, advance: &dyn Fn(usize)) -> Result<()> {
    write_vehicle_crops_until(options, out, advance, &|| false)
}

/// As [`write_vehicle_crops`], until `cancelled` says so.
///
/// # Errors
/// Those, and [`Error::Cancelled`]; the folder then holds a part of the crops.
pub fn write_vehicle_crops_until(
    options: &VehicleCropOptions,
    out: &Path,
    advance: &dyn Fn(usize),
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Result<()> {
    options.validate()?;
    fs::create_dir_all(out).map_err(Error::io(out))?;
    let side = options.side_px as usize;
    let mut crops = NpyWriter::create(&out.join("crops.npy"), "|u1", options.count, &[side, side, 3])?;
    let mut keypoints = NpyWriter::create(&out.join("keypoints.npy"), "<f4", options.count, &[KEYPOINTS, 2])?;
    let mut sights = NpyWriter::create(&out.join("sights.npy"), "|u1", options.count, &[KEYPOINTS])?;
    let mut numbers = NpyWriter::create(&out.join("numbers.npy"), "<f4", options.count, &[COLUMNS.len()])?;
    let textures: Vec<Arc<Textures>> =
        (0..TEXTURES).map(|i| Arc::new(Textures::new(hash::mix(options.seed ^ (0x7e87 + i))))).collect();
    let (mut done, mut next) = (0, 0);
    while done < options.count {
        let made: Vec<Vec<Crop>> = (next..next + BATCH)
            .into_par_iter()
            .map(|number| {
                let textures = &textures[(number % TEXTURES) as usize];
                if cancelled() { Vec::new() } else { crops_of_street(options, number, textures) }
            })
            .collect();
        if cancelled() {
            return Err(Error::Cancelled);
        }
        next += BATCH;
        for crop in made.iter().flatten().take(options.count - done) {
            crops.bytes(&crop.pixels)?;
            keypoints.floats(crop.keypoints.as_flattened())?;
            sights.bytes(&crop.sights)?;
            numbers.floats(&crop.numbers)?;
            done += 1;
        }
        advance(done);
    }
    crops.finish()?;
    keypoints.finish()?;
    sights.finish()?;
    numbers.finish()?;
    let path = out.join("crops.json");
    fs::write(&path, description(options)).map_err(Error::io(&path))
}

fn crops_of_street(options: &VehicleCropOptions, number: u64, textures: &Arc<Textures>) -> Vec<Crop> {
    let street = Street::draw(options.seed, number);
    let renderer = Renderer::with_textures(&street.drive, Arc::clone(textures), street.posts.clone());
    let shape = CropShape { side: options.side_px, margin: options.margin };
    (0..street.views.len())
        .filter_map(|view| {
            let key = hash::mix(options.seed ^ hash::mix(number)) ^ view as u64;
            let mut rng = ChaCha8Rng::seed_from_u64(hash::mix(key));
            crop::render(&renderer, &street, (number, view), shape, &mut rng)
        })
        .collect()
}

fn description(options: &VehicleCropOptions) -> String {
    let list = |names: &[&str]| names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ");
    format!(
        "{{\n  \"count\": {},\n  \"seed\": {},\n  \"side_px\": {},\n  \"margin\": {},\n  \"columns\": [{}],\n  \"bodies\": [{}]\n}}\n",
        options.count,
        options.seed,
        options.side_px,
        options.margin,
        list(&COLUMNS),
        list(&BODY_LABELS)
    )
}
