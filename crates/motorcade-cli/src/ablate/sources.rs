//! Sources of metres, and the settings under which only some of them count.

use motorcade::{Config, ScaleAverage, Settings};

/// Sources of metres that count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sources {
    /// The aligned road under a camera of stated height.
    pub road: bool,
    /// Corners of the road under a camera of stated height; where the road counts too, in frames in which it was not aligned.
    pub points: bool,
    /// Sizes of cars; with the road or its points they correct the stated height, without them they replace it.
    pub vehicles: bool,
    /// Distances of another sensor, without a road if they are alone.
    pub sensor: bool,
}

/// Measurements on the road in the front end, which several variants share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoadUse {
    /// The aligned road.
    Aligned,
    /// Its corners.
    Points,
    /// Its corners where it was not aligned.
    Both,
    /// None.
    Unmeasured,
}

impl Sources {
    /// Each source alone, then all pairs and so on; those with the sensor only where there is one.
    pub fn all(with_sensor: bool) -> Vec<Self> {
        let of = |bits: u32| {
            let on = |k: u32| bits & (1 << k) != 0;
            Self { road: on(0), points: on(1), vehicles: on(2), sensor: on(3) }
        };
        let most = if with_sensor { 1 << 4 } else { 1 << 3 };
        let mut bits: Vec<u32> = (1..most).collect();
        bits.sort_by_key(|b| b.count_ones());
        bits.into_iter().map(of).collect()
    }

    /// Their names.
    pub fn name(self, sensor: &str) -> String {
        let named = [
            (self.road, "road"),
            (self.points, "points"),
            (self.vehicles, "vehicles"),
            (self.sensor, sensor),
        ];
        named.iter().filter(|(on, _)| *on).map(|(_, name)| *name).collect::<Vec<_>>().join(" + ")
    }

    /// The measurements on the road. Sizes of vehicles need the road to be carried from frame to frame; a sensor does not.
    pub fn road_use(self) -> RoadUse {
        match (self.road, self.points, self.vehicles) {
            (true, true, _) => RoadUse::Both,
            (false, true, _) => RoadUse::Points,
            (false, false, false) => RoadUse::Unmeasured,
            _ => RoadUse::Aligned,
        }
    }

    /// Settings of the estimator.
    pub fn apply(self, mut settings: Settings) -> Settings {
        let height_stated = self.road || self.points;
        settings.config.scale.height.combined = self.vehicles && height_stated;
        if !self.sensor {
            settings.external.distances = None;
        }
        if self.vehicles && !height_stated { settings.with_height_by_vehicles() } else { settings }
    }
}

impl RoadUse {
    /// Every use.
    pub const ALL: [Self; 4] = [Self::Aligned, Self::Points, Self::Both, Self::Unmeasured];

    /// Configuration of the front end. Scales of corners are medians: their mean is that of a few wrong matches.
    pub fn configure(self, config: Config) -> Config {
        let mut scale = config.scale;
        scale.road = self != Self::Unmeasured;
        scale.closed_form = self == Self::Points;
        scale.points = self == Self::Both;
        scale.average = ScaleAverage::Median;
        Config { scale, ..config }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_testing::{CAMERA, CAMERA_HEIGHT_M};

    #[test]
    fn every_source_is_alone_once_and_all_are_together_once() {
        let names = |sensor: bool| -> Vec<String> {
            Sources::all(sensor).into_iter().map(|s| s.name("speed")).collect()
        };
        assert_eq!(names(true)[..4], ["road", "points", "vehicles", "speed"]);
        assert_eq!(names(true).len(), 15);
        assert_eq!(names(true)[14], "road + points + vehicles + speed");
        assert_eq!(names(false).len(), 7);
        assert!(!names(false).iter().any(|name| name.contains("speed")), "{:?}", names(false));
    }

    #[test]
    fn only_what_counts_gives_metres() {
        let stated = || Settings::new(CAMERA, CAMERA_HEIGHT_M);
        for sources in Sources::all(true) {
            let settings = sources.apply(stated());
            let unknown = sources.vehicles && !sources.road && !sources.points;
            assert_eq!(settings.height_unknown, unknown, "{sources:?}");
            assert_eq!(settings.height_m == CAMERA_HEIGHT_M, !unknown, "{sources:?}");
            let alone = !(sources.road || sources.points || sources.vehicles);
            assert_eq!(sources.road_use() == RoadUse::Unmeasured, alone, "{sources:?}");
        }
        let config = RoadUse::Points.configure(Config::default()).scale;
        assert!(config.road && config.closed_form && !config.points);
    }
}
