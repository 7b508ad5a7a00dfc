//! Static scenery beside the road.

mod buildings;
mod ground;
mod plants;
mod plots;

pub(crate) use ground::kerb_height_m;
pub(crate) use plants::pole;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::drive::Drive;
use crate::mesh::{Building, Chunk};

/// Height of a kerb \[m\].
pub(crate) const KERB_M: f64 = 0.13;
/// Width of the pavement \[m\].
pub(crate) const PAVEMENT_M: f64 = 2.6;

/// Meshes of the static scenery, and the appearance of the buildings.
pub(crate) fn build(drive: &Drive) -> (Vec<Chunk>, Vec<Building>) {
    // At another visit the streets are those of the first one.
    let drive = drive.first_visit.as_deref().unwrap_or(drive);
    // Scenery has its own random stream: it does not depend on the traffic.
    let mut rng = ChaCha8Rng::seed_from_u64(drive.seed ^ 0x5ce9e);
    let mut chunks = ground::chunks(&drive.road);
    let mut looks = Vec::new();
    plots::place(drive, &mut rng, &mut chunks, &mut looks);
    (chunks, looks)
}
