//! A vehicle seen in one frame.

use std::fmt;
use std::str::FromStr;

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
    /// Car, van, truck and bus are hard to tell apart: one vehicle can be found as several of them.
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

/// An axis-parallel box in pixels, x1 ≤ x2, y1 ≤ y2.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BoundingBox {
    /// Left edge \[px\].
    pub x1: f64,
    /// Upper edge \[px\].
    pub y1: f64,
    /// Right edge \[px\].
    pub x2: f64,
    /// Lower edge \[px\].
    pub y2: f64,
}

impl BoundingBox {
    /// From x1, y1, x2, y2 \[px\].
    pub fn new([x1, y1, x2, y2]: [f64; 4]) -> Self {
        Self { x1, y1, x2, y2 }
    }
    /// x1, y1, x2, y2 \[px\].
    pub fn to_array(self) -> [f64; 4] {
        [self.x1, self.y1, self.x2, self.y2]
    }
    /// Width \[px\].
    pub fn width(&self) -> f64 {
        self.x2 - self.x1
    }
    /// Height \[px\].
    pub fn height(&self) -> f64 {
        self.y2 - self.y1
    }
    /// Area \[px²\].
    pub fn area(&self) -> f64 {
        self.width().max(0.0) * self.height().max(0.0)
    }
    /// Centre x, y \[px\].
    pub fn centre(&self) -> (f64, f64) {
        (0.5 * (self.x1 + self.x2), 0.5 * (self.y1 + self.y2))
    }
    /// True when the pixel lies in the box.
    pub fn contains(&self, x: f64, y: f64) -> bool {
        x >= self.x1 && x <= self.x2 && y >= self.y1 && y <= self.y2
    }
    /// The part inside an image.
    #[must_use]
    pub fn clipped(&self, width: u32, height: u32) -> Self {
        let (right, bottom) = (f64::from(width) - 1.0, f64::from(height) - 1.0);
        Self {
            x1: self.x1.clamp(0.0, right),
            y1: self.y1.clamp(0.0, bottom),
            x2: self.x2.clamp(0.0, right),
            y2: self.y2.clamp(0.0, bottom),
        }
    }
    /// Intersection over union, 0 to 1.
    pub fn iou(&self, other: &Self) -> f64 {
        let width = self.x2.min(other.x2) - self.x1.max(other.x1);
        let height = self.y2.min(other.y2) - self.y1.max(other.y1);
        if width <= 0.0 || height <= 0.0 {
            return 0.0;
        }
        let both = width * height;
        both / (self.area() + other.area() - both)
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
    /// Where it is.
    pub bbox: BoundingBox,
    /// Convention of the box.
    #[serde(default)]
    pub convention: BoxConvention,
    /// Identity given by the file it came from.
    pub external_id: Option<i64>,
}
