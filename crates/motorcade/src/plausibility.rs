//! Settings and results that are possible but rarely meant.

use motorcade_geometry::PinholeCamera;

use crate::check_options::PlausibilityOptions;
use crate::focal_by_turns::FocalByTurns;
use crate::result::RunResult;

/// Warnings about a camera and its height, each naming its field.
pub(crate) fn of_camera(camera: &PinholeCamera, height_m: f64, options: &PlausibilityOptions) -> Vec<String> {
    let mut out = Vec::new();
    let [lowest, highest] = options.heights_m;
    if !(lowest..=highest).contains(&height_m) {
        out.push(format!(
            "the camera height of {height_m} m lies outside {lowest} to {highest} m; all lengths are proportional to it"
        ));
    }
    for (name, centre, side) in [("cx", camera.cx, camera.width), ("cy", camera.cy, camera.height)] {
        let third = f64::from(side) / 3.0;
        if !(third..=2.0 * third).contains(&centre) {
            out.push(format!("{name} = {centre} px lies outside the middle third of {side} px: a cropped image, or an error"));
        }
    }
    let (fx, fy) = (camera.fx, camera.fy);
    if fx.max(fy) > (1.0 + options.focal_difference) * fx.min(fy) {
        out.push(format!(
            "fx = {fx} px and fy = {fy} px differ by more than {} %: pixels that are not square, or an error",
            100.0 * options.focal_difference
        ));
    }
    let (horizontal, vertical) = camera.field_of_view_rad();
    for (name, view) in [("fx", horizontal), ("fy", vertical)] {
        if view > options.widest_rad {
            out.push(format!(
                "{name} is a field of view of {:.0} degrees, wider than lenses that are pinholes; state a smaller one, below 120, as view_deg of a TOML calibration",
                view.to_degrees()
            ));
        }
    }
    out
}

/// A warning about a focal length \[px\] that the turns of the drive contradict.
pub(crate) fn of_focal_length(found: &FocalByTurns) -> Option<String> {
    let FocalByTurns { stated_px, px, sigma_px, .. } = *found;
    found.contradicts().then(|| {
        format!(
            "the focal length of {stated_px:.0} px disagrees with the drive, whose turns say {px:.0} ± {sigma_px:.0} px: all distances may be wrong by as much; \
             check the calibration (fx, fy), or estimate it: motorcade calibrate"
        )
    })
}

/// Warnings about speeds no road vehicle has.
pub(crate) fn of_speeds(result: &RunResult, options: &PlausibilityOptions) -> Vec<String> {
    let fastest_mps = options.fastest_mps;
    let mut out = Vec::new();
    let speeds = (1..result.frames.len().min(result.ego.frames.len())).filter_map(|k| {
        let (before, frame) = (&result.frames[k - 1], &result.frames[k]);
        let speed = result.way_m(k) / ((frame.timestamp_ns - before.timestamp_ns) as f64 * 1e-9);
        (speed > fastest_mps).then_some((frame.number, speed))
    });
    let fast: Vec<(u64, f64)> = speeds.collect();
    if let Some((number, speed)) = fast.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
        out.push(format!(
            "the camera drives faster than {fastest_mps} m/s in {} frames, {speed:.0} m/s in frame {number}: check the height, the \
             frame rate and the unit of a given trajectory",
            fast.len()
        ));
    }
    let fast =
        |v: &&motorcade_vehicles::VehicleTrajectory| v.states.iter().any(|s| s.speed_mps.abs() > fastest_mps);
    let ids: Vec<String> = result.vehicles.iter().filter(fast).map(|v| v.id.to_string()).collect();
    if !ids.is_empty() {
        out.push(format!(
            "vehicles faster than {fastest_mps} m/s (speed_mps in tracks.csv): {}",
            ids.join(", ")
        ));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite;
    use crate::test_results::{result, vehicle};
    use motorcade_geometry::Pose;
    use motorcade_vehicles::VehicleState;
    use nalgebra::Vector3;

    #[test]
    fn fields_that_are_rarely_meant_are_named() {
        let options = PlausibilityOptions::default();
        let kitti = PinholeCamera { fx: 721.5, fy: 721.5, cx: 609.6, cy: 172.9, width: 1242, height: 375 };
        assert!(of_camera(&kitti, 1.65, &options).is_empty());
        for (camera, height_m, named) in [
            (kitti, 12.0, "height of 12 m"),
            (kitti, 0.2, "height of 0.2 m"),
            (PinholeCamera { cx: 80.0, ..kitti }, 1.65, "cx = 80"),
            (PinholeCamera { cy: 300.0, ..kitti }, 1.65, "cy = 300"),
            (PinholeCamera { fy: 780.0, ..kitti }, 1.65, "fy = 780"),
            (PinholeCamera { fx: 300.0, fy: 300.0, ..kitti }, 1.65, "fx is a field of view of 128 degrees"),
        ] {
            let warnings = of_camera(&camera, height_m, &options);
            assert!(warnings.len() == 1 && warnings[0].contains(named), "{warnings:?}");
        }
    }

    #[test]
    fn speeds_of_no_road_vehicle_are_named() {
        let options = PlausibilityOptions::default();
        let at = |speed_mps: f64| VehicleState { speed_mps, ..finite::tests::state(0.04) };
        let drive = |speeds: &[(usize, f64)]| {
            let vehicles = speeds.iter().map(|(id, speed_mps)| vehicle(*id, vec![at(1.0), at(*speed_mps)]));
            result(3, vehicles.collect())
        };
        assert!(of_speeds(&drive(&[(3, 99.0), (7, -99.0)]), &options).is_empty());
        let warnings = of_speeds(&drive(&[(3, 99.0), (7, 101.0), (12, -130.0)]), &options);
        assert_eq!(warnings, ["vehicles faster than 100 m/s (speed_mps in tracks.csv): 7, 12"]);
        // 11 m in a tenth of a second.
        let mut fast = drive(&[]);
        fast.ego.frames[2].world_from_camera = Pose::from_parts(
            fast.ego.frames[1].world_from_camera.rotation(),
            fast.ego.frames[1].world_from_camera.translation() + Vector3::z() * 11.0,
        );
        let warnings = of_speeds(&fast, &options);
        assert!(
            warnings.len() == 1 && warnings[0].contains("100 m/s in 1 frames, 110 m/s in frame 2"),
            "{warnings:?}"
        );
    }
}
