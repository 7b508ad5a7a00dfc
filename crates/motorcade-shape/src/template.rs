//! Lengths of a car that published lists lack, as shares of the lengths they have.

use crate::blueprint::Blueprint;
use crate::body_type::BodyType;

/// Proportions of a body type: estimates by eye, means of two to six cars of the type. In order:
///
/// - of length less wheelbase: the front overhang;
/// - of the wheelbase, behind the front axle: windscreen base, roof front;
/// - of the rear overhang, behind the rear axle: roof rear, rear window base;
/// - of the height: bonnet, windscreen base, rear window base, tail.
pub(crate) struct Template([f64; 9]);

/// Reduction of the front overhang, as a share of length less wheelbase, with driven rear wheels: the engine is behind the axle.
const REAR_DRIVEN_LESS: f64 = 0.03;

impl Template {
    /// Of an ordinary car of this type.
    #[rustfmt::skip] // one type a line
    pub(crate) const fn of(body_type: BodyType) -> Self {
        Self(match body_type {
            BodyType::City =>      [0.56, 0.14, 0.35,  0.48,  0.82, 0.52, 0.67, 0.67, 0.58],
            BodyType::Hatchback => [0.55, 0.16, 0.39,  0.31,  0.83, 0.51, 0.66, 0.69, 0.62],
            BodyType::Saloon =>    [0.45, 0.23, 0.47, -0.25,  0.42, 0.51, 0.66, 0.71, 0.64],
            BodyType::Estate =>    [0.45, 0.21, 0.45,  0.58,  0.80, 0.50, 0.65, 0.70, 0.62],
            BodyType::Suv =>       [0.49, 0.20, 0.41,  0.45,  0.73, 0.54, 0.66, 0.69, 0.61],
            BodyType::Van =>       [0.54, 0.10, 0.33,  0.60,  0.84, 0.48, 0.64, 0.63, 0.59],
            BodyType::Coupe =>     [0.49, 0.23, 0.51, -0.22,  0.60, 0.50, 0.68, 0.70, 0.62],
        })
    }
    /// The same with driven rear wheels only.
    pub(crate) const fn rear_driven(mut self) -> Self {
        self.0[0] -= REAR_DRIVEN_LESS;
        self
    }
    /// A car of this length, width, height and wheelbase \[m\].
    pub(crate) const fn drawn(&self, size: [f64; 4], tyre_diameter_m: f64) -> Blueprint {
        let Self([overhang, screen, roof_front, roof_rear, window, bonnet, screen_z, window_z, tail]) = *self;
        let [length_m, width_m, height_m, wheelbase_m] = size;
        let overhangs_m = length_m - wheelbase_m;
        let rear_overhang_m = (1.0 - overhang) * overhangs_m;
        Blueprint {
            length_m,
            width_m,
            height_m,
            wheelbase_m,
            front_overhang_m: overhang * overhangs_m,
            tyre_diameter_m,
            bonnet_height_m: bonnet * height_m,
            windscreen_base_m: screen * wheelbase_m,
            windscreen_base_height_m: screen_z * height_m,
            roof_front_m: roof_front * wheelbase_m,
            roof_rear_m: roof_rear * rear_overhang_m,
            rear_window_base_m: window * rear_overhang_m,
            rear_window_base_height_m: window_z * height_m,
            tail_height_m: tail * height_m,
        }
    }
}
