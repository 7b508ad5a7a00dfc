//! Trailers, their sizes and hitches.

use motorcade_perception::VehicleClass;
use motorcade_vehicles::Dimensions;

use crate::form::Form;
use crate::motion::Hitch;

/// Kind of a trailer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrailerKind {
    /// Box of 13.6 m whose front rests on a tractor, over the tractor's rear axle.
    Semi,
    /// Caravan with a drawbar of 1.2 m, on the ball behind a car.
    Caravan,
}

/// Size of a tractor \[m\].
const TRACTOR: Dimensions = Dimensions { length_m: 6.0, width_m: 2.5, height_m: 3.8 };
/// Kingpin ahead of the tractor's rear axle, and behind the front of its trailer \[m\].
const KINGPIN_M: (f64, f64) = (0.4, 1.6);

impl TrailerKind {
    /// Length with the drawbar, width and height \[m\].
    pub(crate) fn size(self) -> Dimensions {
        match self {
            Self::Semi => Dimensions { length_m: 13.6, width_m: 2.5, height_m: 3.95 },
            Self::Caravan => Dimensions { length_m: 6.4, width_m: 2.2, height_m: 2.55 },
        }
    }

    /// Size of the towing vehicle \[m\], where it is no usual vehicle of its class.
    pub(crate) fn towing_size(self) -> Option<Dimensions> {
        (self == Self::Semi).then_some(TRACTOR)
    }

    /// Class of the detector, whose classes have no trailers.
    pub(crate) fn detected_as(self) -> VehicleClass {
        match self {
            Self::Semi => VehicleClass::Truck,
            Self::Caravan => VehicleClass::Van,
        }
    }

    /// The form of its body.
    pub(crate) fn form(self) -> Form {
        let height_m = self.size().height_m;
        let (front_axle, rear_axle, tyre_m) = match self {
            Self::Semi => (-0.135, -0.232, 0.5),
            Self::Caravan => (-0.141, -0.141, 0.33),
        };
        Form { front_axle, rear_axle, tyre_radius: tyre_m / height_m, glasshouse: None }
    }

    /// Its hitch on a vehicle of this length and form.
    pub(crate) fn hitch(self, towing_length_m: f64, towing: &Form) -> Hitch {
        let length_m = self.size().length_m;
        let form = self.form();
        let axle_m = 0.5 * (form.front_axle + form.rear_axle) * length_m;
        let (ahead_m, to_centre_m) = match self {
            Self::Semi => (towing.rear_axle * towing_length_m + KINGPIN_M.0, 0.5 * length_m - KINGPIN_M.1),
            Self::Caravan => (-0.5 * towing_length_m, 0.5 * length_m),
        };
        Hitch { ahead_m, to_axle_m: to_centre_m - axle_m, to_centre_m }
    }
}
