//! Cues of a vehicle's position, and the settings without which each counts no more.

use motorcade::Preset;

use super::suites::{Variant, variant};

/// A cue of a vehicle's position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cue {
    /// Size of the class: distance from the height of the box.
    Size,
    /// Contact with the ground: distance from the lower edge and the road's plane.
    Ground,
    /// Keypoints: shape and heading of a car.
    Keypoints,
    /// One size and shape of all frames of a track.
    SharedSize,
    /// Motion between frames: smoothing, headings by the travel.
    Motion,
    /// One place of a vehicle that stands, seen from the way of the camera.
    Standing,
    /// The multi-object graph.
    Graph,
}

impl Cue {
    /// Cues of single frames.
    const SINGLE: [Self; 3] = [Self::Size, Self::Ground, Self::Keypoints];
    /// Cues that join frames.
    const JOINT: [Self; 4] = [Self::SharedSize, Self::Motion, Self::Standing, Self::Graph];

    /// Name in the table.
    fn name(self) -> &'static str {
        match self {
            Self::Size => "size of the class",
            Self::Ground => "ground contact",
            Self::Keypoints => "keypoints",
            Self::SharedSize => "shared size",
            Self::Motion => "motion",
            Self::Standing => "standing vehicles as one place",
            Self::Graph => "graph",
        }
    }

    /// Settings that switch it off: deviations so wide that the others decide, or its own switch.
    fn off(self) -> &'static [&'static str] {
        match self {
            Self::Size => &["vehicles.advanced.size.prior_factor=10.0"],
            Self::Ground => &[
                "vehicles.advanced.box_fit.road_height_sigma_m=100.0",
                "vehicles.advanced.keypoints.road_height_sigma_m=100.0",
            ],
            Self::Keypoints => &["vehicles.advanced.keypoints.enabled=false"],
            Self::SharedSize => &[
                "vehicles.advanced.size.shared=false",
                "vehicles.advanced.keypoints.least_shape_frames=1000",
                "graph.advanced.shared_size=false",
            ],
            Self::Motion => &[
                "vehicles.advanced.motion.acceleration_density=100.0",
                "vehicles.advanced.motion.vertical_density=100.0",
                "graph.vehicle_vehicle=false",
            ],
            // Below every probability: all vehicles move.
            Self::Standing => &[
                "vehicles.advanced.kinematic_state.moving_from=-1.0",
                "graph.advanced.static_below_p_moving=-1.0",
            ],
            Self::Graph => &["graph.enabled=false"],
        }
    }
}

/// The default, each cue left out of it, then cues of single frames alone, in pairs and together, and each joint cue beside these.
pub fn variants() -> Vec<Variant> {
    let all = || Cue::SINGLE.into_iter().chain(Cue::JOINT);
    let mut out = vec![variant("default", Preset::Default, &[])];
    out.extend(
        all().map(|cue| variant(format!("default without {}", cue.name()), Preset::Default, cue.off())),
    );
    let headings = "vehicles.advanced.keypoints.variance_factor=1e6";
    out.push(variant("default, headings and sizes of keypoints alone", Preset::Default, &[headings]));
    let only = |on: &[Cue]| {
        let off: Vec<&str> = all().filter(|cue| !on.contains(cue)).flat_map(Cue::off).copied().collect();
        let names: Vec<&str> = on.iter().map(|cue| cue.name()).collect();
        variant(format!("{} only", names.join(" + ")), Preset::Default, &off)
    };
    let [size, ground, keypoints] = Cue::SINGLE;
    for on in
        [&[size][..], &[ground], &[keypoints], &[size, ground], &[size, keypoints], &[ground, keypoints]]
    {
        out.push(only(on));
    }
    out.push(only(&Cue::SINGLE));
    out.extend(Cue::JOINT.map(|joint| only(&[size, ground, keypoints, joint])));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade::Config;

    #[test]
    fn every_cue_is_left_out_once_and_every_setting_exists() {
        let variants = variants();
        assert_eq!(variants.len(), 20);
        for cue in Cue::SINGLE.into_iter().chain(Cue::JOINT) {
            let name = format!("default without {}", cue.name());
            assert!(variants.iter().any(|v| v.name == name), "{name}");
        }
        for variant in &variants {
            let set = |config: Config, assignment: &String| config.set(assignment).unwrap();
            let config = variant.set.iter().fold(Config::default(), set);
            assert_eq!(config == Config::default(), variant.set.is_empty(), "{}", variant.name);
        }
    }
}
