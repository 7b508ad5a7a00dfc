//! Vehicles hidden from the camera by others that are nearer to it.
//!
//! A tracker takes an edge of a box for hidden where another box with a lower bottom edge covers it, before anything is known of distances. Where the
//! vehicle then comes out nearer than what is said to hide it, nothing hides it, and its box ends where it ends.

use motorcade_geometry::{BoundingBox, PinholeCamera};
use motorcade_perception::BoxConvention;

use crate::ground::GroundFrame;
use crate::observed_box::{SLACK_PX, hidden_edges, inside_border};
use crate::options::{BoxFitOptions, VehicleOptions};
use crate::outline::image_box;
use crate::track::{Track, TrackBox, boxes_of};
use crate::trajectory::VehicleTrajectory;

/// The vehicles, those whose boxes do not agree with the others in front of them estimated anew with the edges that nothing hides as measurements.
/// Such an estimate stands where it explains more of the boxes.
pub fn with_hiding_checked(
    vehicles: Vec<VehicleTrajectory>,
    tracks: &[Track],
    camera: &PinholeCamera,
    grounds: &[GroundFrame],
    options: &VehicleOptions,
    estimate: impl Fn(&Track) -> Option<VehicleTrajectory>,
) -> Vec<VehicleTrajectory> {
    let pictures = Pictures::new(&vehicles, camera, grounds);
    let hypothesis = &options.advanced.hypothesis;
    let checked = |(index, vehicle): (usize, &VehicleTrajectory)| {
        let boxes = tracks.iter().find_map(|track| boxes_of(track, vehicle))?;
        let explained = |found: &VehicleTrajectory| {
            let own = Pictures::of(found, camera, grounds);
            let explains = |b: &&TrackBox| {
                pictures.explains((index, own.at(b.frame)), b, camera, hypothesis.least_visible_iou)
            };
            boxes.boxes.iter().filter(explains).count()
        };
        let (before, count) = (explained(vehicle), boxes.boxes.len());
        if (count - before) as f64 <= hypothesis.most_foreign_share * count as f64 {
            return None;
        }
        let mut shown = boxes.clone();
        for b in &mut shown.boxes {
            pictures.show_edges(index, b, camera, &options.advanced.box_fit);
        }
        if shown.boxes == boxes.boxes {
            return None;
        }
        estimate(&shown).filter(|found| explained(found) > before)
    };
    let again: Vec<Option<VehicleTrajectory>> = vehicles.iter().enumerate().map(checked).collect();
    vehicles.into_iter().zip(again).map(|(vehicle, again)| again.unwrap_or(vehicle)).collect()
}

/// A vehicle in the picture of a frame.
#[derive(Clone, Copy, Debug)]
struct Shown {
    /// Index of the vehicle.
    vehicle: usize,
    /// Its box by its estimate, not cut by the border \[px\].
    projected: BoundingBox,
    /// Its box by the detector, else by its estimate \[px\].
    bbox: BoundingBox,
}

impl Shown {
    /// True when it stands nearer than another one: its lower edge is lower.
    fn is_before(&self, projected: &BoundingBox) -> bool {
        self.projected.y2 > projected.y2 + SLACK_PX
    }
}

/// The vehicles of each frame as the camera sees them.
pub(crate) struct Pictures(Vec<Vec<Shown>>);

impl Pictures {
    pub(crate) fn new(
        vehicles: &[VehicleTrajectory],
        camera: &PinholeCamera,
        grounds: &[GroundFrame],
    ) -> Self {
        let mut frames = vec![Vec::new(); grounds.len()];
        for (index, vehicle) in vehicles.iter().enumerate() {
            for state in &vehicle.states {
                let Some(ground) = grounds.get(state.frame) else { continue };
                let pose = ground.world_from_camera.inverse() * state.world_from_vehicle;
                let convention = BoxConvention::VisibleExtent;
                // A vehicle beside or behind the camera has no box.
                if let Some(projected) = image_box(camera, &pose, vehicle.class, convention, &vehicle.size) {
                    let bbox = state.bbox.unwrap_or(projected);
                    frames[state.frame].push(Shown { vehicle: index, projected, bbox });
                }
            }
        }
        Self(frames)
    }

    /// One vehicle alone.
    fn of(vehicle: &VehicleTrajectory, camera: &PinholeCamera, grounds: &[GroundFrame]) -> Self {
        Self::new(std::slice::from_ref(vehicle), camera, grounds)
    }

    fn frame(&self, frame: usize) -> &[Shown] {
        self.0.get(frame).map_or(&[], Vec::as_slice)
    }

    /// The projected box of the only vehicle.
    fn at(&self, frame: usize) -> Option<BoundingBox> {
        self.frame(frame).first().map(|shown| shown.projected)
    }

    /// For each state of a vehicle whether it explains the box that the state has.
    pub(crate) fn explained(
        &self,
        (index, vehicle): (usize, &VehicleTrajectory),
        tracks: &[Track],
        camera: &PinholeCamera,
        least_iou: f64,
    ) -> Vec<bool> {
        let mut explained = vec![true; vehicle.states.len()];
        let (Some(track), Some(first)) =
            (tracks.iter().find_map(|track| boxes_of(track, vehicle)), vehicle.states.first())
        else {
            return explained;
        };
        for b in &track.boxes {
            let projected = self.frame(b.frame).iter().find(|s| s.vehicle == index).map(|s| s.projected);
            if let Some(slot) = b.frame.checked_sub(first.frame).and_then(|k| explained.get_mut(k)) {
                *slot = self.explains((index, projected), b, camera, least_iou);
            }
        }
        explained
    }

    /// True when a box shows a vehicle that projects there, whole or what the nearer ones leave of it, within the border of the picture.
    fn explains(
        &self,
        (index, projected): (usize, Option<BoundingBox>),
        b: &TrackBox,
        camera: &PinholeCamera,
        least_iou: f64,
    ) -> bool {
        let Some(projected) = projected.filter(|_| b.observed.convention == BoxConvention::VisibleExtent)
        else {
            return true;
        };
        let nearer = |s: &&Shown| s.vehicle != index && s.is_before(&projected);
        let before: Vec<BoundingBox> =
            self.frame(b.frame).iter().filter(nearer).map(|s| s.projected).collect();
        let Some(whole) = cut(&projected, &picture(camera)) else { return false };
        let overlaps = |part: &BoundingBox| b.observed.bbox.iou(part) >= least_iou;
        overlaps(&whole) || visible_part(&whole, &before).is_some_and(|part| overlaps(&part))
    }

    /// Makes measurements of the hidden edges of a box before which no nearer vehicle stands.
    fn show_edges(&self, index: usize, b: &mut TrackBox, camera: &PinholeCamera, options: &BoxFitOptions) {
        let frame = self.frame(b.frame);
        let Some(own) = frame.iter().find(|s| s.vehicle == index) else { return };
        let all_others = frame.iter().filter(|s| s.vehicle != index);
        let (before, behind): (Vec<&Shown>, Vec<&Shown>) =
            all_others.partition(|s| s.is_before(&own.projected));
        let hidden = |by: &[&Shown]| {
            let mut hidden = [false; 4];
            for other in by {
                let one = hidden_edges(&b.observed.bbox, &other.bbox, options.occluded_share);
                hidden = std::array::from_fn(|edge| hidden[edge] || one[edge]);
            }
            hidden
        };
        let (truly, falsely) = (hidden(&before), hidden(&behind));
        let inside = inside_border(&b.observed.bbox, camera, options.border_px * b.observed.pixel_size);
        for edge in 0..4 {
            b.observed.edges[edge] |= inside[edge] && falsely[edge] && !truly[edge];
        }
    }
}

/// The picture as a box \[px\].
fn picture(camera: &PinholeCamera) -> BoundingBox {
    BoundingBox::new([0.0, 0.0, f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0])
}

/// The common part of two boxes.
fn cut(a: &BoundingBox, b: &BoundingBox) -> Option<BoundingBox> {
    let part = BoundingBox::new([a.x1.max(b.x1), a.y1.max(b.y1), a.x2.min(b.x2), a.y2.min(b.y2)]);
    (part.x1 < part.x2 && part.y1 < part.y2).then_some(part)
}

/// The box around what others leave of one; `None` where they cover all of it.
fn visible_part(whole: &BoundingBox, others: &[BoundingBox]) -> Option<BoundingBox> {
    let covering: Vec<BoundingBox> = others.iter().filter_map(|other| cut(whole, other)).collect();
    let (x1, x2) = visible_range([whole.x1, whole.x2], [whole.y1, whole.y2], &covering, |b| {
        ([b.x1, b.x2], [b.y1, b.y2])
    })?;
    let (y1, y2) = visible_range([whole.y1, whole.y2], [whole.x1, whole.x2], &covering, |b| {
        ([b.y1, b.y2], [b.x1, b.x2])
    })?;
    Some(BoundingBox::new([x1, y1, x2, y2]))
}

/// From the first to the last place `along` a box at which boxes within it leave something of the range `across`. `sides` gives the ranges of each of them
/// along and across.
fn visible_range(
    along: [f64; 2],
    across: [f64; 2],
    covering: &[BoundingBox],
    sides: fn(&BoundingBox) -> ([f64; 2], [f64; 2]),
) -> Option<(f64, f64)> {
    let mut ranges: Vec<([f64; 2], [f64; 2])> = covering.iter().map(sides).collect();
    ranges.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
    let mut places: Vec<f64> = ranges.iter().flat_map(|(own, _)| *own).chain(along).collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    let is_visible = |strip: &&[f64]| {
        let mut reached = across[0];
        for (own, [from, to]) in &ranges {
            if own[0] <= strip[0] && strip[1] <= own[1] {
                if *from > reached {
                    return true;
                }
                reached = reached.max(*to);
            }
        }
        reached < across[1]
    };
    let first = places.windows(2).find(is_visible)?;
    let last = places.windows(2).rev().find(is_visible)?;
    Some((first[0], last[1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_vehicles::{CAMERA, car_ahead, level_grounds, track_of};

    #[test]
    fn what_others_leave_of_a_box() {
        let whole = BoundingBox::new([0.0, 0.0, 10.0, 10.0]);
        let part = |others: &[[f64; 4]]| {
            let others: Vec<BoundingBox> = others.iter().map(|b| BoundingBox::new(*b)).collect();
            visible_part(&whole, &others).map(|b| b.to_array())
        };
        assert_eq!(part(&[]), Some([0.0, 0.0, 10.0, 10.0]));
        assert_eq!(part(&[[-5.0, -5.0, 4.0, 20.0]]), Some([4.0, 0.0, 10.0, 10.0]));
        // A corner alone hides no side of it; two that cover it leave nothing.
        assert_eq!(part(&[[-5.0, 5.0, 4.0, 20.0]]), Some([0.0, 0.0, 10.0, 10.0]));
        assert_eq!(part(&[[-5.0, -5.0, 4.0, 20.0], [3.0, -1.0, 11.0, 11.0]]), None);
    }

    /// Against a look at every cell between the edges of all boxes.
    #[test]
    fn what_others_leave_is_the_same_cell_by_cell() {
        let mut state = 1_u32;
        let mut next = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from((state >> 16) % below)
        };
        let whole = BoundingBox::new([0.0, 0.0, 12.0, 9.0]);
        let (mut some, mut none) = (0, 0);
        for round in 0..2000 {
            let count = 1 + round % 9;
            let others: Vec<BoundingBox> = (0..count)
                .map(|_| {
                    let (x, y) = (next(14) - 2.0, next(11) - 2.0);
                    BoundingBox::new([x, y, x + 1.0 + next(12), y + 1.0 + next(9)])
                })
                .collect();
            let mut cells: Option<BoundingBox> = None;
            for (x, y) in (0..12).flat_map(|x| (0..9).map(move |y| (f64::from(x), f64::from(y)))) {
                if !others.iter().any(|b| b.contains(x + 0.5, y + 0.5)) {
                    let own = cells.unwrap_or_else(|| BoundingBox::new([x, y, x + 1.0, y + 1.0]));
                    let (low, high) =
                        ((own.x1.min(x), own.y1.min(y)), (own.x2.max(x + 1.0), own.y2.max(y + 1.0)));
                    cells = Some(BoundingBox::new([low.0, low.1, high.0, high.1]));
                }
            }
            assert_eq!(visible_part(&whole, &others), cells, "{others:?}");
            (some, none) = (some + i32::from(cells.is_some()), none + i32::from(cells.is_none()));
        }
        assert!(some > 100 && none > 0, "{some} {none}");
    }

    /// With a look at every cell between their edges it takes minutes.
    #[test]
    fn a_thousand_boxes_are_looked_at_in_no_time() {
        let whole = BoundingBox::new([0.0, 0.0, 5000.0, 5000.0]);
        let at = |k: u32| f64::from(k) * 5.0;
        let others: Vec<BoundingBox> =
            (0..1000).map(|k| BoundingBox::new([at(k), 0.0, at(k) + 5.5, 5000.0 - at(k)])).collect();
        let start = std::time::Instant::now();
        assert_eq!(visible_part(&whole, &others).map(|b| b.y2), Some(5000.0));
        assert!(start.elapsed().as_secs_f64() < 2.0, "{:?}", start.elapsed());
    }

    #[test]
    fn a_nearer_car_hides_a_part_and_a_farther_one_none() {
        let mut vehicles = vec![car_ahead(0, 0.0, 30.0), car_ahead(1, 1.0, 15.0)];
        // Of the far car only the left third shows.
        for state in &mut vehicles[0].states {
            let b = state.bbox.unwrap();
            state.bbox = Some(BoundingBox { x2: b.x1 + b.width() / 3.0, ..b });
        }
        let tracks = [track_of(&vehicles[0], [true, true, false, true])];
        let explained = |vehicles: &[VehicleTrajectory]| {
            let pictures = Pictures::new(vehicles, &CAMERA, &level_grounds(10));
            pictures.explained((0, &vehicles[0]), &tracks, &CAMERA, 0.4)
        };
        assert_eq!(explained(&vehicles), [true; 10]);
        let farther = [vehicles[0].clone(), car_ahead(1, 1.0, 50.0)];
        assert_eq!(explained(&farther), [false; 10]);
    }

    #[test]
    fn edges_that_only_a_farther_car_covers_are_measured() {
        let seen = |edges| {
            let vehicles = vec![car_ahead(0, 0.0, 30.0), car_ahead(1, 1.0, 50.0)];
            let mut tracked = track_of(&vehicles[0], edges);
            // Boxes of the farther car that end lower, as those of clutter do.
            let mut shown = Pictures::new(&vehicles, &CAMERA, &level_grounds(10));
            for frame in &mut shown.0 {
                let own = frame[0].bbox;
                frame[1].bbox = BoundingBox::new([own.x2 - 2.0, own.y1, own.x2 + 50.0, own.y2 + 9.0]);
            }
            shown.show_edges(0, &mut tracked.boxes[3], &CAMERA, &BoxFitOptions::default());
            tracked.boxes[3].observed.edges
        };
        assert_eq!(seen([true, true, false, true]), [true; 4]);
        // The lower edge is hidden by something else.
        assert_eq!(seen([true, true, false, false]), [true, true, true, false]);
    }
}
