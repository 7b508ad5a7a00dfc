//! Reliability of the probability that a vehicle moves.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use motorcade_dataset::Cam0;
use motorcade_geometry::{Pose, World};
use nalgebra::Point3;

use crate::deviations::VehicleDeviations;
use crate::matching::{ByFrame, assign, in_frame};

/// Edges of the table's rows.
const EDGES: [f64; 6] = [0.0, 0.05, 0.3, 0.7, 0.95, 1.0];
/// Vehicles that are this fast over a second move \[m/s\]: labels of standing ones wander by less.
const MOVES_MPS: f64 = 1.0;
/// Shortest time over which a labelled vehicle's speed is told \[s\].
const LEAST_TIME_S: f64 = 0.5;

/// Reliability of P(moving): of the vehicles that say 0.8, 80 % should move.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct MovingReport {
    /// Estimated vehicles that were labelled for half a second and more.
    pub vehicles: usize,
    /// Mean of (P − 1)² of those that move and P² of those that stand: 0.25 for those who always say 0.5.
    pub brier: f64,
    /// Vehicles by what they say.
    pub rows: Vec<MovingRow>,
}

/// Vehicles with a P(moving) in some range, which holds its upper end only when that is 1.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct MovingRow {
    /// Least and largest P(moving).
    pub range: [f64; 2],
    /// Vehicles.
    pub vehicles: usize,
    /// Their mean P(moving).
    pub p_moving: f64,
    /// Share of them that moves.
    pub moves: f64,
}

/// Labels and estimates, with the true poses of the camera.
pub(crate) struct Motion<'a> {
    /// Labelled vehicles with their boxes in the processed camera, and their positions.
    pub boxes: &'a ByFrame,
    pub labels: &'a ByFrame,
    pub estimates: &'a ByFrame,
    pub world_from_cam0: Vec<Pose<World, Cam0>>,
    /// Frame number of row 0.
    pub first: u64,
    pub fps: f64,
}

impl<'a> Motion<'a> {
    /// `None` when no labelled vehicle is estimated for long enough.
    pub(crate) fn reliability(
        &self,
        deviations: impl Iterator<Item = &'a VehicleDeviations>,
    ) -> Option<MovingReport> {
        let stated = deviations.filter(|d| (0.0..=1.0).contains(&d.p_moving));
        let p_moving: BTreeMap<i64, f64> = stated.map(|d| (d.id, d.p_moving)).collect();
        let told = self.pairs().into_iter().filter_map(|(estimate, rows)| {
            let (label, rows) = rows.into_iter().max_by_key(|(label, rows)| (rows.len(), Reverse(*label)))?;
            Some((*p_moving.get(&estimate)?, self.moves(label, &rows)?))
        });
        MovingReport::of(&told.collect::<Vec<(f64, bool)>>())
    }

    /// Rows in which each estimate shows each label.
    fn pairs(&self) -> BTreeMap<i64, BTreeMap<i64, Vec<usize>>> {
        let mut pairs: BTreeMap<i64, BTreeMap<i64, Vec<usize>>> = BTreeMap::new();
        for row in 0..self.world_from_cam0.len() {
            let frame = self.first + row as u64;
            let boxes = in_frame(self.boxes, frame);
            let estimates = in_frame(self.estimates, frame);
            for (label, assigned) in boxes.iter().zip(assign(boxes, estimates)) {
                if let Some(j) = assigned {
                    pairs.entry(estimates[j].track).or_default().entry(label.track).or_default().push(row);
                }
            }
        }
        pairs
    }

    /// True for a vehicle that moves in some second of these rows; `None` when they are too few to tell.
    fn moves(&self, label: i64, rows: &[usize]) -> Option<bool> {
        let span = rows.last()? - rows.first()?;
        let window = (self.fps.round() as usize).min(span);
        let time_s = window as f64 / self.fps;
        if time_s < LEAST_TIME_S {
            return None;
        }
        let mut speeds = (rows[0]..=rows[0] + span - window).filter_map(|row| {
            let way = self.position(label, row + window)? - self.position(label, row)?;
            Some(way.norm() / time_s)
        });
        let first = speeds.next()?;
        Some(speeds.fold(first, f64::max) >= MOVES_MPS)
    }

    fn position(&self, label: i64, row: usize) -> Option<Point3<f64>> {
        let labels = in_frame(self.labels, self.first + row as u64);
        let found = labels.iter().find(|l| l.track == label)?;
        Some(self.world_from_cam0[row].transform_point(&Point3::from(found.location_m)))
    }
}

impl MovingReport {
    /// Of vehicles with what they say and whether they move.
    fn of(told: &[(f64, bool)]) -> Option<Self> {
        let error = |(p, moves): &(f64, bool)| (p - f64::from(u8::from(*moves))).powi(2);
        let row = |edges: &[f64]| {
            let (from, to) = (edges[0], edges[1]);
            let inside = told.iter().filter(|(p, _)| *p >= from && (*p < to || to >= 1.0));
            let (vehicles, sum, moving) = inside.fold((0, 0.0, 0), |(n, sum, moving), (p, moves)| {
                (n + 1, sum + p, moving + usize::from(*moves))
            });
            let count = vehicles as f64;
            let filled = MovingRow {
                range: [from, to],
                vehicles,
                p_moving: sum / count,
                moves: moving as f64 / count,
            };
            (vehicles > 0).then_some(filled)
        };
        (!told.is_empty()).then(|| Self {
            vehicles: told.len(),
            brier: told.iter().map(error).sum::<f64>() / told.len() as f64,
            rows: EDGES.windows(2).filter_map(row).collect(),
        })
    }
}
