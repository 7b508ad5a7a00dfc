//! The family of cars the prior is made from: every ordinary body of a published list.
//!
//! The list is `EuroSegmentCar.csv` of the Joint Research Centre of the European Commission, in PyPI `co2mpas_driver` 1.3.4: cars
//! sold in Europe, most of them in 2012 to 2015. Length, width (without mirrors), height, wheelbase and driven wheels are those of
//! the numbered row (its `Category-Item`). The diameter of the tyres is 2.06 times its dynamic rolling radius, which is the size of
//! the tyre: 0.585 m is a 185/55 R15, on the Fiat 500. The list names no makes. Names are ours, where body, year and lengths leave
//! no doubt; nothing depends on them.
//!
//! Selection of rows: one for each distinct body, the first where several agree to 5 mm in all four lengths (a facelift that changed one
//! counts as another); released in 2003 or later, with a fixed roof, four seats or more, and every figure given; up to 5.0 m long
//! (beyond are limousines) and 1.9 m high (beyond are upright off-roaders). Hatchbacks up to 3.75 m are city cars; above 4.5 m
//! they are saloons in outline with a door at the back, fit neither drawing, and are left out. The other types are as the list has
//! them. `scripts/published_dimensions.py` checks every figure against the list, and that no row is missing or there without right.
//!
//! Estimated, as the list does not have them: front overhang, and the heights and places of bonnet, windows, roof and tail, by one
//! template a body type (`template.rs`), to about 5 cm for the mean of a type.
//!
//! The list has no pickups and no van above 1.80 m; no list found has all four lengths of any, so neither shapes the prior.

use crate::blueprint::Blueprint;
use crate::body_type::BodyType;
use crate::template::Template;

/// One model of the family.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarModel {
    /// Its row in the published list.
    pub row: u32,
    /// Make and model, or kind and row.
    pub name: &'static str,
    /// Body type.
    pub body_type: BodyType,
    /// Its lengths.
    pub blueprint: Blueprint,
}

/// The wheels that drive.
enum Driven {
    Front,
    Rear,
    All,
}

/// Length, width, height, wheelbase \[m\].
type Size = [f64; 4];

const fn listed(
    row: u32,
    name: &'static str,
    body_type: BodyType,
    size: Size,
    tyre_diameter_m: f64,
    driven: Driven,
) -> CarModel {
    let ordinary = Template::of(body_type);
    let template = match driven {
        Driven::Front | Driven::All => ordinary,
        Driven::Rear => ordinary.rear_driven(),
    };
    let blueprint = template.drawn(size, tyre_diameter_m);
    CarModel { row, name, body_type, blueprint }
}

/// Every model, by body type and length.
#[rustfmt::skip] // one car a line
pub const FAMILY: &[CarModel] = &[
    listed(26629, "Volkswagen up!", BodyType::City, [3.540, 1.641, 1.489, 2.420], 0.585, Driven::Front),
    listed(35135, "Fiat 500", BodyType::City, [3.546, 1.627, 1.488, 2.300], 0.585, Driven::Front),
    listed(8358, "city car 8358", BodyType::City, [3.563, 1.641, 1.463, 2.420], 0.587, Driven::Front),
    listed(15109, "city car 15109", BodyType::City, [3.581, 1.611, 1.643, 2.305], 0.608, Driven::All),
    listed(4396, "city car 4396", BodyType::City, [3.610, 1.660, 1.500, 2.370], 0.583, Driven::Front),
    listed(27748, "city car 27748", BodyType::City, [3.653, 1.643, 1.551, 2.300], 0.583, Driven::Front),
    listed(8183, "Renault Twingo II", BodyType::City, [3.687, 1.654, 1.470, 2.367], 0.583, Driven::Front),
    listed(41388, "hatchback 41388", BodyType::Hatchback, [3.918, 1.683, 1.463, 2.486], 0.595, Driven::Front),
    listed(7897, "Peugeot 208 GTi", BodyType::Hatchback, [3.962, 1.739, 1.450, 2.538], 0.621, Driven::Front),
    listed(7972, "Peugeot 208", BodyType::Hatchback, [3.962, 1.739, 1.460, 2.538], 0.621, Driven::Front),
    listed(44387, "Volkswagen Polo V", BodyType::Hatchback, [3.972, 1.682, 1.453, 2.470], 0.600, Driven::Front),
    listed(5779, "Skoda Fabia III", BodyType::Hatchback, [3.992, 1.732, 1.467, 2.470], 0.603, Driven::Front),
    listed(15552, "hatchback 15552", BodyType::Hatchback, [4.020, 1.746, 1.534, 2.588], 0.621, Driven::Front),
    listed(5768, "Opel Corsa E", BodyType::Hatchback, [4.021, 1.736, 1.479, 2.510], 0.621, Driven::Front),
    listed(40516, "hatchback 40516", BodyType::Hatchback, [4.027, 1.707, 1.493, 2.575], 0.601, Driven::Front),
    listed(3408, "hatchback 3408", BodyType::Hatchback, [4.058, 1.733, 1.518, 2.589], 0.621, Driven::Front),
    listed(8620, "Fiat Punto", BodyType::Hatchback, [4.065, 1.687, 1.490, 2.510], 0.621, Driven::Front),
    listed(10133, "hatchback 10133", BodyType::Hatchback, [4.220, 1.760, 1.515, 2.600], 0.632, Driven::Front),
    listed(2508, "Audi A3 8V", BodyType::Hatchback, [4.237, 1.777, 1.421, 2.601], 0.634, Driven::Front),
    listed(20409, "hatchback 20409", BodyType::Hatchback, [4.245, 1.760, 1.510, 2.600], 0.632, Driven::Front),
    listed(34092, "Peugeot 308 II", BodyType::Hatchback, [4.253, 1.804, 1.457, 2.620], 0.637, Driven::Front),
    listed(26539, "Volkswagen Golf VII", BodyType::Hatchback, [4.255, 1.799, 1.452, 2.637], 0.634, Driven::Front),
    listed(8709, "hatchback 8709", BodyType::Hatchback, [4.300, 1.780, 1.465, 2.650], 0.634, Driven::Front),
    listed(34271, "Renault Megane III", BodyType::Hatchback, [4.302, 1.808, 1.471, 2.640], 0.652, Driven::Front),
    listed(5635, "Citroen C4 II", BodyType::Hatchback, [4.329, 1.789, 1.489, 2.608], 0.634, Driven::Front),
    listed(26765, "hatchback 26765", BodyType::Hatchback, [4.369, 1.802, 1.435, 2.647], 0.637, Driven::Front),
    listed(1872, "Volvo V40 Cross Country", BodyType::Hatchback, [4.370, 1.802, 1.470, 2.646], 0.657, Driven::Front),
    listed(7661, "Opel Astra J", BodyType::Hatchback, [4.419, 1.814, 1.510, 2.685], 0.657, Driven::Front),
    listed(6378, "Ford Focus III saloon", BodyType::Saloon, [4.538, 1.823, 1.484, 2.648], 0.647, Driven::Front),
    listed(26799, "Audi A4 B8", BodyType::Saloon, [4.701, 1.826, 1.427, 2.808], 0.654, Driven::All),
    listed(35476, "Volkswagen Passat B8", BodyType::Saloon, [4.767, 1.832, 1.461, 2.791], 0.664, Driven::Front),
    listed(36525, "Peugeot 508", BodyType::Saloon, [4.792, 1.853, 1.456, 2.817], 0.664, Driven::Front),
    listed(1431, "saloon 1431", BodyType::Saloon, [4.825, 1.815, 1.430, 2.850], 0.657, Driven::Rear),
    listed(1840, "Volvo S80 II", BodyType::Saloon, [4.851, 1.860, 1.493, 2.835], 0.657, Driven::Front),
    listed(39396, "BMW 5 Series F10", BodyType::Saloon, [4.907, 1.860, 1.464, 2.968], 0.679, Driven::All),
    listed(5909, "Audi A6 C7", BodyType::Saloon, [4.933, 1.874, 1.455, 2.912], 0.678, Driven::All),
    listed(8280, "Seat Ibiza ST", BodyType::Estate, [4.227, 1.693, 1.445, 2.469], 0.600, Driven::Front),
    listed(10328, "estate 10328", BodyType::Estate, [4.522, 1.770, 1.457, 2.640], 0.632, Driven::Front),
    listed(34499, "estate 34499", BodyType::Estate, [4.535, 1.816, 1.444, 2.634], 0.647, Driven::Front),
    listed(34474, "estate 34474", BodyType::Estate, [4.543, 1.816, 1.481, 2.630], 0.657, Driven::All),
    listed(39723, "Peugeot 308 SW II", BodyType::Estate, [4.585, 1.804, 1.471, 2.730], 0.634, Driven::Front),
    listed(3079, "BMW 3 Series Touring F31", BodyType::Estate, [4.624, 1.811, 1.429, 2.810], 0.652, Driven::Rear),
    listed(2090, "Volvo V60", BodyType::Estate, [4.628, 1.865, 1.484, 2.776], 0.645, Driven::Front),
    listed(34603, "Skoda Octavia Combi III", BodyType::Estate, [4.659, 1.814, 1.461, 2.680], 0.637, Driven::Front),
    listed(4350, "estate 4350", BodyType::Estate, [4.700, 1.760, 1.525, 2.700], 0.632, Driven::Front),
    listed(36591, "estate 36591", BodyType::Estate, [4.715, 1.760, 1.525, 2.700], 0.647, Driven::Front),
    listed(5725, "estate 5725", BodyType::Estate, [4.800, 1.840, 1.480, 2.750], 0.679, Driven::Front),
    listed(47766, "Peugeot 508 SW", BodyType::Estate, [4.813, 1.853, 1.476, 2.817], 0.664, Driven::Front),
    listed(34760, "Skoda Superb Combi II", BodyType::Estate, [4.833, 1.817, 1.510, 2.761], 0.632, Driven::Front),
    listed(40130, "Mercedes-Benz E-Class Estate S212", BodyType::Estate, [4.895, 1.854, 1.512, 2.874], 0.652, Driven::Rear),
    listed(33986, "estate 33986", BodyType::Estate, [4.913, 1.858, 1.514, 2.737], 0.678, Driven::Front),
    listed(33958, "estate 33958", BodyType::Estate, [4.920, 1.858, 1.525, 2.737], 0.692, Driven::Front),
    listed(34202, "Renault Captur", BodyType::Suv, [4.122, 1.778, 1.566, 2.606], 0.657, Driven::Front),
    listed(34024, "Peugeot 2008", BodyType::Suv, [4.159, 1.739, 1.556, 2.538], 0.640, Driven::Front),
    listed(7836, "Opel Mokka", BodyType::Suv, [4.278, 1.777, 1.658, 2.555], 0.690, Driven::Front),
    listed(40170, "Nissan Qashqai II", BodyType::Suv, [4.377, 1.806, 1.590, 2.646], 0.685, Driven::Front),
    listed(5358, "Audi Q3", BodyType::Suv, [4.388, 1.831, 1.608, 2.603], 0.690, Driven::All),
    listed(22563, "Volkswagen Tiguan", BodyType::Suv, [4.426, 1.809, 1.703, 2.604], 0.690, Driven::Front),
    listed(8866, "Land Rover Freelander 2", BodyType::Suv, [4.500, 1.910, 1.740, 2.660], 0.737, Driven::All),
    listed(9738, "Ford Kuga II", BodyType::Suv, [4.524, 1.838, 1.702, 2.690], 0.692, Driven::Front),
    listed(6446, "Land Rover Discovery Sport", BodyType::Suv, [4.599, 1.895, 1.724, 2.741], 0.741, Driven::All),
    listed(6222, "BMW X3 F25", BodyType::Suv, [4.657, 1.881, 1.661, 2.810], 0.702, Driven::All),
    listed(9551, "BMW X5 M F85", BodyType::Suv, [4.880, 1.985, 1.754, 2.933], 0.736, Driven::All),
    listed(9872, "Range Rover L405", BodyType::Suv, [4.999, 1.983, 1.835, 2.922], 0.789, Driven::All),
    listed(9645, "people carrier 9645", BodyType::Van, [4.101, 1.766, 1.631, 2.540], 0.621, Driven::Front),
    listed(34058, "Peugeot 3008", BodyType::Van, [4.365, 1.837, 1.639, 2.613], 0.657, Driven::Front),
    listed(34286, "Renault Scenic III", BodyType::Van, [4.366, 1.845, 1.640, 2.702], 0.657, Driven::Front),
    listed(7979, "Citroen Berlingo and Peugeot Partner II", BodyType::Van, [4.380, 1.810, 1.801, 2.728], 0.647, Driven::Front),
    listed(20699, "Volkswagen Touran", BodyType::Van, [4.397, 1.794, 1.674, 2.678], 0.632, Driven::Front),
    listed(19028, "people carrier 19028", BodyType::Van, [4.658, 1.820, 1.685, 2.760], 0.657, Driven::Front),
    listed(24268, "Ford S-Max", BodyType::Van, [4.768, 1.884, 1.658, 2.850], 0.657, Driven::Front),
    listed(22376, "Porsche 911 991", BodyType::Coupe, [4.509, 1.852, 1.295, 2.450], 0.679, Driven::Rear),
    listed(18771, "Mercedes-Benz C-Class Coupe C204", BodyType::Coupe, [4.590, 1.770, 1.406, 2.760], 0.647, Driven::Rear),
    listed(27096, "Audi A5 8T", BodyType::Coupe, [4.626, 1.854, 1.372, 2.751], 0.653, Driven::All),
    listed(24313, "coupe 24313", BodyType::Coupe, [4.630, 1.865, 1.385, 2.820], 0.679, Driven::Rear),
    listed(5603, "BMW 6 Series Coupe F13", BodyType::Coupe, [4.894, 1.894, 1.369, 2.855], 0.679, Driven::All),
];
