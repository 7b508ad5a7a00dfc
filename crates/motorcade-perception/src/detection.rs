//! A vehicle seen in one frame.

use std::fmt;
use std::str::FromStr;

pub use motorcade_geometry::BoundingBox;

/// Kinds of vehicles, named as in KITTI where it has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum VehicleClass {
    /// Passenger car.
    Car,
    /// Van.
    Van,
    /// Truck.
    Truck,
    /// Bus or coach.
    Bus,
    /// Motorcycle with its rider.
    Motorcycle,
}

impl VehicleClass {
    /// All classes.
    pub const ALL: [Self; 5] = [Self::Car, Self::Van, Self::Truck, Self::Bus, Self::Motorcycle];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Car => "Car",
            Self::Van => "Van",
            Self::Truck => "Truck",
            Self::Bus => "Bus",
            Self::Motorcycle => "Motorcycle",
        }
    }
    /// Car, van, truck and bus are easily confused: one vehicle can be found as several of them.
    pub fn is_four_wheeled(self) -> bool {
        self != Self::Motorcycle
    }
}

impl fmt::Display for VehicleClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The name is no vehicle's.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{0}` is no vehicle class (Car, Van, Truck, Bus, Motorcycle)")]
pub struct NoVehicle(String);

impl FromStr for VehicleClass {
    type Err = NoVehicle;
    fn from_str(text: &str) -> Result<Self, NoVehicle> {
        let found = Self::ALL.into_iter().find(|class| class.name().eq_ignore_ascii_case(text));
        found.ok_or_else(|| NoVehicle(text.to_owned()))
    }
}

/// Convention by which a box encloses its vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BoxConvention {
    /// The visible extent, as detectors draw it.
    #[default]
    VisibleExtent,
    /// The eight corners of its 3D box, hidden or not, clipped to the image: boxes of label files that have 3D boxes. On five
    /// KITTI sequences they are those of the projected corners within a pixel. Of a car 20 m ahead such a box ends 3 px below its tyres.
    ProjectedCuboid,
}

/// One vehicle in one frame.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Detection {
    /// Kind of vehicle.
    pub class: VehicleClass,
    /// Confidence, 0 to 1 from networks; files may have other ranges.
    pub score: f64,
    /// Position in the image.
    pub bbox: BoundingBox,
    /// Convention of the box.
    #[serde(default)]
    pub convention: BoxConvention,
    /// Identity given by the file it came from.
    pub external_id: Option<i64>,
    /// Size of a pixel of the detector's input in pixels of the image; 1 where that is unknown. Edges are not known better.
    #[serde(default = "one")]
    pub pixel_size: f64,
    /// Mean probability of road in a strip below the box ([`RoadMask::share_below`](crate::RoadMask::share_below)); `None` where
    /// that is hidden or no road is known. Detectors leave it out: it is set when the frame's road is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub road_below: Option<f64>,
}

fn one() -> f64 {
    1.0
}
