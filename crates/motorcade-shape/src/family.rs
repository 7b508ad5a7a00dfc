//! The family of cars the prior is made from: real models, by their dimensions as remembered.
//!
//! Remembered: length, width (without mirrors), height and wheelbase of all 32. They are meant to be those of the manufacturers'
//! data sheets, and no data sheet was at hand: single figures may be off by a centimetre or a model year, or wrong. Estimated:
//! front overhang, tyre diameter, and the heights and places of bonnet, windows and roof, from the models' general proportions,
//! to about 5 cm. Sourced, figure by figure: none. No package that could be found has modern European cars with all four lengths.
//!
//! Checked against figures that others published, in `tests/published_dimensions.rs` (sources and tolerances there):
//!
//! - as they are, within their rounding: length and wheelbase of the E-Class W211 and the A4 B8, wheelbase of the Transporter T5;
//! - length and wheelbase against the same car's generation before, of 2004: 14 models; wheelbase against a later one: 10;
//! - width against forebears of 1985 or 1993: 9 models; height against those of 1985: 7;
//! - wheelbase on length for each body type, width on length and height for ordinary cars, and their spread in the prior,
//!   against lists of 1985, 1993 and 2004; front overhangs and tyres against six cars.
//!
//! The test says what it would see: all lengths, widths or wheelbases off by 1 %, all heights by 4 %; a single wheelbase off by
//! 15 cm on 17 of the 32 cars, a length by 25 cm on 14, a width by 10 cm on 7, a height by 20 cm on 7. Fiat 500, up!, Twingo,
//! Corsa, Astra, Tiguan, Qashqai, Kangoo, Vito and Hilux have no relative there. Other checks: proportions of three cars in
//! `tests/catalogue.rs`, and the published shape prior in `tests/published.rs`.

use crate::blueprint::Blueprint;
use crate::body_type::BodyType;

/// One model of the family.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarModel {
    /// Make and model.
    pub name: &'static str,
    /// Body type.
    pub body_type: BodyType,
    /// Its lengths.
    pub blueprint: Blueprint,
}

/// Remembered: length, width, height, wheelbase; estimated: front overhang, tyre diameter \[m\].
type Sheet = [f64; 6];
/// Estimated \[m\]: bonnet height; windscreen base behind the front axle, its height; roof front behind the front axle;
/// roof rear and rear window base behind the rear axle, the latter's height; height of the tail.
type Glasshouse = [f64; 8];

const fn model(name: &'static str, body_type: BodyType, sheet: Sheet, glass: Glasshouse) -> CarModel {
    let blueprint = Blueprint {
        length_m: sheet[0],
        width_m: sheet[1],
        height_m: sheet[2],
        wheelbase_m: sheet[3],
        front_overhang_m: sheet[4],
        tyre_diameter_m: sheet[5],
        bonnet_height_m: glass[0],
        windscreen_base_m: glass[1],
        windscreen_base_height_m: glass[2],
        roof_front_m: glass[3],
        roof_rear_m: glass[4],
        rear_window_base_m: glass[5],
        rear_window_base_height_m: glass[6],
        tail_height_m: glass[7],
    };
    CarModel { name, body_type, blueprint }
}

/// Every model, by body type.
#[rustfmt::skip] // one car a line
pub const FAMILY: &[CarModel] = &[
    model("Fiat 500", BodyType::City, [3.546, 1.627, 1.488, 2.300, 0.700, 0.580], [0.78, 0.33, 0.99, 0.83, 0.22, 0.42, 1.00, 0.86]),
    model("Volkswagen up!", BodyType::City, [3.540, 1.641, 1.489, 2.420, 0.590, 0.600], [0.78, 0.30, 0.99, 0.83, 0.30, 0.44, 1.00, 0.86]),
    model("Renault Twingo II", BodyType::City, [3.602, 1.654, 1.470, 2.367, 0.680, 0.570], [0.78, 0.33, 0.99, 0.83, 0.28, 0.46, 1.00, 0.86]),
    model("Toyota Yaris II", BodyType::City, [3.750, 1.695, 1.530, 2.460, 0.750, 0.590], [0.78, 0.33, 1.03, 0.83, 0.25, 0.45, 1.00, 0.86]),
    model("Volkswagen Polo V", BodyType::Hatchback, [3.970, 1.682, 1.462, 2.470, 0.830, 0.600], [0.76, 0.43, 0.98, 1.02, 0.20, 0.56, 1.02, 0.92]),
    model("Opel Corsa D", BodyType::Hatchback, [3.999, 1.737, 1.488, 2.511, 0.850, 0.610], [0.76, 0.36, 0.98, 0.95, 0.20, 0.56, 1.02, 0.92]),
    model("Peugeot 207", BodyType::Hatchback, [4.030, 1.748, 1.472, 2.540, 0.860, 0.610], [0.76, 0.34, 0.98, 0.98, 0.20, 0.56, 1.02, 0.92]),
    model("Volkswagen Golf VI", BodyType::Hatchback, [4.199, 1.779, 1.479, 2.578, 0.880, 0.630], [0.76, 0.43, 0.98, 1.02, 0.26, 0.62, 1.02, 0.92]),
    model("Opel Astra H", BodyType::Hatchback, [4.249, 1.753, 1.460, 2.614, 0.910, 0.630], [0.76, 0.43, 0.98, 1.02, 0.20, 0.56, 1.02, 0.92]),
    model("Ford Focus II", BodyType::Hatchback, [4.342, 1.840, 1.497, 2.640, 0.900, 0.640], [0.76, 0.43, 0.98, 1.02, 0.26, 0.64, 1.02, 0.92]),
    model("Volkswagen Passat B6", BodyType::Saloon, [4.765, 1.820, 1.472, 2.709, 0.950, 0.650], [0.74, 0.58, 0.96, 1.24, -0.20, 0.45, 1.02, 0.93]),
    model("BMW 3 Series E90", BodyType::Saloon, [4.520, 1.817, 1.421, 2.760, 0.750, 0.630], [0.74, 0.66, 0.93, 1.34, -0.28, 0.45, 1.02, 0.93]),
    model("Mercedes-Benz C-Class W204", BodyType::Saloon, [4.581, 1.770, 1.447, 2.760, 0.780, 0.630], [0.74, 0.64, 0.96, 1.32, -0.28, 0.45, 1.02, 0.93]),
    model("Audi A4 B8", BodyType::Saloon, [4.703, 1.826, 1.427, 2.808, 0.840, 0.650], [0.74, 0.62, 0.96, 1.30, -0.28, 0.45, 1.02, 0.93]),
    model("Mercedes-Benz E-Class W211", BodyType::Saloon, [4.818, 1.822, 1.452, 2.854, 0.830, 0.650], [0.74, 0.64, 0.96, 1.36, -0.28, 0.45, 1.02, 0.93]),
    model("Audi A4 Avant B8", BodyType::Estate, [4.699, 1.826, 1.436, 2.808, 0.840, 0.650], [0.74, 0.58, 0.96, 1.22, 0.50, 0.84, 1.04, 0.93]),
    model("Volkswagen Passat Variant B6", BodyType::Estate, [4.774, 1.820, 1.517, 2.709, 0.950, 0.650], [0.74, 0.58, 0.97, 1.22, 0.68, 0.92, 1.04, 0.93]),
    model("Skoda Octavia Combi II", BodyType::Estate, [4.572, 1.769, 1.468, 2.578, 0.910, 0.630], [0.74, 0.58, 0.97, 1.22, 0.66, 0.88, 1.04, 0.93]),
    model("Volvo V70 III", BodyType::Estate, [4.823, 1.861, 1.547, 2.816, 0.920, 0.660], [0.74, 0.58, 0.97, 1.22, 0.66, 0.84, 1.04, 0.93]),
    model("Volkswagen Tiguan", BodyType::Suv, [4.427, 1.809, 1.686, 2.604, 0.900, 0.690], [0.90, 0.50, 1.11, 1.06, 0.42, 0.68, 1.16, 1.02]),
    model("Nissan Qashqai", BodyType::Suv, [4.315, 1.783, 1.606, 2.630, 0.860, 0.680], [0.86, 0.50, 1.07, 1.06, 0.42, 0.68, 1.16, 1.02]),
    model("Toyota RAV4 III", BodyType::Suv, [4.395, 1.815, 1.685, 2.560, 0.890, 0.700], [0.90, 0.50, 1.11, 1.06, 0.42, 0.68, 1.16, 1.02]),
    model("BMW X5 E70", BodyType::Suv, [4.854, 1.933, 1.766, 2.933, 0.870, 0.750], [0.96, 0.62, 1.16, 1.20, 0.42, 0.68, 1.20, 1.06]),
    model("Volkswagen Touran", BodyType::Van, [4.407, 1.794, 1.635, 2.678, 0.900, 0.640], [0.80, 0.26, 1.06, 0.92, 0.42, 0.66, 1.06, 0.98]),
    model("Renault Kangoo II", BodyType::Van, [4.213, 1.829, 1.803, 2.697, 0.860, 0.620], [0.84, 0.26, 1.14, 0.88, 0.46, 0.58, 1.12, 1.04]),
    model("Volkswagen Transporter T5", BodyType::Van, [4.890, 1.904, 1.970, 3.000, 0.900, 0.660], [0.92, 0.14, 1.24, 0.62, 0.76, 0.92, 1.22, 1.12]),
    model("Mercedes-Benz Vito W639", BodyType::Van, [4.748, 1.901, 1.902, 3.200, 0.820, 0.660], [0.90, 0.20, 1.20, 0.68, 0.52, 0.62, 1.20, 1.10]),
    model("Toyota Hilux VII", BodyType::Pickup, [5.260, 1.835, 1.860, 3.085, 0.910, 0.760], [0.96, 0.52, 1.14, 1.12, -1.02, -0.84, 1.16, 0.98]),
    model("Ford Ranger T6", BodyType::Pickup, [5.359, 1.850, 1.815, 3.220, 0.910, 0.760], [0.96, 0.52, 1.14, 1.12, -1.02, -0.84, 1.16, 0.98]),
    model("Audi TT 8J", BodyType::Coupe, [4.178, 1.842, 1.352, 2.468, 0.900, 0.640], [0.68, 0.60, 0.91, 1.30, -0.12, 0.62, 0.96, 0.86]),
    model("BMW 3 Series Coupe E92", BodyType::Coupe, [4.612, 1.782, 1.375, 2.760, 0.780, 0.640], [0.68, 0.68, 0.93, 1.44, -0.35, 0.42, 0.96, 0.86]),
    model("Porsche 911 997", BodyType::Coupe, [4.461, 1.808, 1.310, 2.350, 0.980, 0.650], [0.66, 0.44, 0.91, 1.10, -0.22, 0.74, 0.90, 0.80]),
];
