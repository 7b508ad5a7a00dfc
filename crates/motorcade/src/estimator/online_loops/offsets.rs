//! Moves of the world of the estimator over the last seconds: each correction by loops moves what is estimated from then on.

use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::{EgoFrame, Uncertainty};
use motorcade_vehicles::VehicleState;

use crate::relative::exchange_camera;

/// A move of that world.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
struct Move {
    /// The first row it holds for.
    first: usize,
    offset: Pose<World, World>,
    /// Uncertainty of the moved pose at that row.
    uncertainty: Uncertainty,
}

/// Moves of the world of the estimator over the last seconds, in order of rows.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(in crate::estimator) struct Offsets {
    moves: Vec<Move>,
    /// Pose of the newest row without moves.
    newest: Option<Pose<World, Camera>>,
    /// Uncertainty of the newest moved pose; `None` before the first move.
    uncertainty: Option<Uncertainty>,
}

impl Offsets {
    /// The move at a row; `None` before the first.
    fn of(&self, row: usize) -> Option<&Move> {
        let after = self.moves.partition_point(|m| m.first <= row);
        self.moves.get(after.checked_sub(1)?)
    }

    /// The offset at a row.
    pub(super) fn at(&self, row: usize) -> Pose<World, World> {
        self.of(row).map(|m| m.offset).unwrap_or_default()
    }

    /// Takes the camera of the newest row, without moves.
    pub(super) fn push(&mut self, camera: &EgoFrame) {
        if let (Some(before), Some(uncertainty)) = (self.newest, &mut self.uncertainty) {
            advance(uncertainty, &before, camera);
        }
        self.newest = Some(camera.world_from_camera);
    }

    /// Adds a move from the newest row on. `known` is what is known of the camera of the first of `cameras`, which are those of all rows from
    /// there to the newest one without moves.
    pub(super) fn add(
        &mut self,
        newest: usize,
        offset: Pose<World, World>,
        mut known: Uncertainty,
        cameras: &[EgoFrame],
    ) {
        for pair in cameras.windows(2) {
            advance(&mut known, &pair[0].world_from_camera, &pair[1]);
        }
        self.uncertainty = Some(known.clone());
        self.moves.push(Move { first: newest, offset, uncertainty: known });
    }

    /// The newest camera and its vehicles as they are returned.
    pub(in crate::estimator) fn newest<'a>(
        &self,
        row: usize,
        camera: &mut EgoFrame,
        vehicles: impl Iterator<Item = &'a mut VehicleState>,
    ) {
        let (Some(Move { offset, .. }), Some(uncertainty)) = (self.of(row), &self.uncertainty) else {
            return;
        };
        let before = camera.clone();
        place(camera, offset, uncertainty);
        vehicles.for_each(|state| carry(state, offset, (&before, camera)));
    }

    /// All cameras, and the states of all vehicles, as they were returned.
    pub(in crate::estimator) fn all<'a>(
        &self,
        cameras: &mut [EgoFrame],
        vehicles: impl Iterator<Item = &'a mut VehicleState>,
    ) {
        let before = cameras.to_vec();
        let mut uncertainty = Uncertainty::default();
        for (row, camera) in cameras.iter_mut().enumerate() {
            let Some(Move { first, offset, uncertainty: known }) = self.of(row) else { continue };
            if *first == row {
                uncertainty = known.clone();
            } else {
                advance(&mut uncertainty, &before[row - 1].world_from_camera, camera);
            }
            place(camera, offset, &uncertainty);
        }
        for state in vehicles {
            let known = before.get(state.frame).zip(cameras.get(state.frame));
            if let Some((Move { offset, .. }, known)) = self.of(state.frame).zip(known) {
                carry(state, offset, known);
            }
        }
    }
}

fn advance(uncertainty: &mut Uncertainty, before: &Pose<World, Camera>, camera: &EgoFrame) {
    uncertainty.advance(camera, &(before.inverse() * camera.world_from_camera).cast());
}

/// Moves a vehicle with its camera, as it was `before` and is now.
fn carry(state: &mut VehicleState, offset: &Pose<World, World>, (before, now): (&EgoFrame, &EgoFrame)) {
    exchange_camera(state, before, now);
    state.world_from_vehicle = *offset * state.world_from_vehicle;
}

fn place(camera: &mut EgoFrame, offset: &Pose<World, World>, uncertainty: &Uncertainty) {
    camera.world_from_camera = *offset * camera.world_from_camera;
    camera.covariance = uncertainty.covariance();
}
