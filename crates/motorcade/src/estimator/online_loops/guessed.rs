//! Rows of a map that has just begun, told with a guessed scale before its road was measured.

use motorcade_geometry::Pose;
use motorcade_odometry::{EgoFrame, Rows};

/// Share of the standard deviation of an unknown scale from which on a scale counts as guessed: one measurement of the road leaves less than a tenth.
const GUESSED: f64 = 0.5;

/// True of a scale of which nothing was measured.
pub(super) fn guessed(frame: &EgoFrame, unknown_scale_sigma: f64) -> bool {
    frame.scale_sigma > GUESSED * unknown_scale_sigma
}

/// Puts the rows just before the newest one that have a guessed scale where the newest one's scale has them: between those and later rows the
/// camera would have jumped. The row before them stays where it is, from which the newest one was told, too.
pub(super) fn rescale(ego: &mut Rows<EgoFrame>, way_m: &mut Rows<f64>, unknown_scale_sigma: f64) {
    let kept = ego.kept();
    let Some((newest, before)) = kept.split_last().filter(|(f, _)| !guessed(f, unknown_scale_sigma)) else {
        return;
    };
    let run = before.iter().rev().take_while(|f| guessed(f, unknown_scale_sigma)).count();
    let Some(fixed) = kept.get((before.len() - run).saturating_sub(1)) else { return };
    let (scale, fixed) = (newest.scale, fixed.world_from_camera.translation());
    for frame in ego.iter_mut().rev().skip(1).take(run) {
        let moved = fixed + (frame.world_from_camera.translation() - fixed) * (scale / frame.scale);
        frame.world_from_camera = Pose::from_parts(frame.world_from_camera.rotation(), moved);
        frame.scale = scale;
    }
    let from = ego.len() - run - usize::from(run > 0);
    for row in from.max(1)..ego.len() {
        let [Some(a), Some(b)] = [row - 1, row].map(|row| ego.get(row)) else { continue };
        let step_m = (b.world_from_camera.translation() - a.world_from_camera.translation()).norm();
        let before_m = way_m.get(row - 1).copied();
        let way_m = way_m.iter_mut().nth_back(ego.len() - 1 - row);
        if let (Some(way_m), Some(before_m)) = (way_m, before_m) {
            *way_m = before_m + step_m;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circle::scene;
    use nalgebra::Vector3;

    #[test]
    fn rows_with_a_guessed_scale_move_to_the_measured_one() {
        // A straight drive, 1 m a frame; the first four rows were told 1.4 times too far.
        let row = |k: usize| {
            let (scale, scale_sigma) = if k < 4 { (1.4, 0.65) } else { (1.0, 0.02) };
            let mut frame = scene(crate::circle::ROUND, false).ego[0].clone();
            frame.world_from_camera = Pose::from_parts(
                frame.world_from_camera.rotation(),
                Vector3::new(0.0, 0.0, scale * k as f64),
            );
            EgoFrame { scale, scale_sigma, ..frame }
        };
        let (mut ego, mut way_m) = (Rows::default(), Rows::default());
        for k in 0..6 {
            ego.push(row(k));
            way_m.push(1.4 * k as f64);
            rescale(&mut ego, &mut way_m, 0.65);
            let kept = ego.kept();
            let places: Vec<f64> = kept.iter().map(|f| f.world_from_camera.translation().z).collect();
            let expected = |at: usize| if k < 4 { 1.4 * at as f64 } else { at as f64 };
            assert!((0..=k).all(|at| (places[at] - expected(at)).abs() < 1e-12), "{k}: {places:?}");
        }
        assert!((0..5).all(|k| (way_m[k] - k as f64).abs() < 1e-12), "{way_m:?}");
    }
}
