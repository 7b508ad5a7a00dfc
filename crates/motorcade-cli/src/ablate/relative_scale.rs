//! Scale of a vehicle's trajectory by an assumption on its motion: the principle of Namdev, Krishna and Jawahar, *Multibody VSLAM with relative
//! scale solution for curvilinear motion reconstruction*, ICRA 2013, in a formulation of our own.
//!
//! A moving camera gives the positions of a vehicle up to one factor s that all its frames share. In the world they are `X_t(s) = C_t + s·r_t`, with the
//! centre C of the camera and the ray r to the vehicle in the unit of the vehicle. Wheels do not slip sideways, and over a circular arc the
//! displacement has the direction of the mean heading of its two ends: `n·(X_u(s) − X_t(s)) = 0`, n horizontal and normal to that heading. Each pair of frames
//! gives such an equation, linear in s.

use motorcade_geometry::robust::sigma_from_absolute;
use nalgebra::Vector3;

/// Time between the ends of a displacement \[s\]. Longer ones raise the displacement over the noise of positions, but
/// fewer of them are an arc. Tracks shorter than three times this take a third of their duration. Chosen.
const BASELINE_S: f64 = 2.0;
/// Error that all headings of a track share \[rad\]: 3°, the least deviation that a heading by keypoints has.
const COMMON_HEADING_RAD: f64 = 0.05;
/// Relative standard deviation of s up to which it counts as observed. Chosen: 4 m at 20 m.
const MOST_RELATIVE_SIGMA: f64 = 0.2;
/// Scale of the Cauchy kernel in standard deviations: 95 % efficient for normal errors.
const CAUCHY_SCALE: f64 = 2.385;
/// Rounds of reweighting.
const ROUNDS: usize = 10;
/// Equations from which on s is estimated.
const LEAST_EQUATIONS: usize = 3;

/// A vehicle in one frame.
#[derive(Clone, Copy, Debug)]
pub struct Sighting {
    /// Time \[s\].
    pub time_s: f64,
    /// Centre of the camera in the world \[m\].
    pub camera: Vector3<f64>,
    /// From the camera to the vehicle, axes of the world, in the unit of the vehicle.
    pub ray: Vector3<f64>,
    /// Up, axes of the world, unit.
    pub up: Vector3<f64>,
    /// Forward direction of the vehicle, axes of the world, unit; `None` where no heading is measured.
    pub forward: Option<Vector3<f64>>,
}

/// Assumption on the motion of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Assumption {
    /// Displacements along the mean heading of their ends.
    Curvilinear,
    /// Constant velocity over two baselines. Says something where the camera does not drive at a constant velocity.
    Steady,
}

/// Scale of a trajectory.
#[derive(Clone, Copy, Debug)]
pub struct RelativeScale {
    /// Assumption it comes from.
    pub assumption: Assumption,
    /// Metres per unit of the vehicle.
    pub scale: f64,
    /// Standard deviation of it.
    pub sigma: f64,
}

impl RelativeScale {
    /// True where the motion determines the scale. A vehicle that drives ahead as the camera does fits any.
    pub fn is_observable(&self) -> bool {
        self.scale > 0.0 && self.relative_sigma() <= MOST_RELATIVE_SIGMA
    }

    fn relative_sigma(&self) -> f64 {
        self.sigma / self.scale.abs()
    }
}

/// `a·s + b = 0`, of rays and cameras.
#[derive(Clone, Copy)]
struct Equation {
    a: f64,
    b: f64,
    /// The components of the same displacements along the heading; zero where the equation depends on none.
    along: [f64; 2],
}

/// The scale of a trajectory, from sightings in order of time: by the heading where that determines it, else by steady motion if that does, else the
/// better determined one of those in front of the camera. `None` with too few sightings for either.
pub fn relative_scale(sightings: &[Sighting]) -> Option<RelativeScale> {
    let duration_s = sightings.last()?.time_s - sightings.first()?.time_s;
    // Constant velocity spans two baselines, and needs several equations.
    let baseline_s = BASELINE_S.min(duration_s / 3.0);
    let independent = (duration_s / baseline_s).max(1.0);
    let of = |assumption, equations: &[Equation]| {
        let (scale, sigma) = solve(equations, independent)?;
        Some(RelativeScale { assumption, scale, sigma })
    };
    let curvilinear = of(Assumption::Curvilinear, &no_side_slip(sightings, baseline_s));
    let steady = of(Assumption::Steady, &constant_velocity(sightings, baseline_s));
    let found = || curvilinear.into_iter().chain(steady);
    let doubt = |of: &RelativeScale| (of.scale <= 0.0, of.relative_sigma());
    let least = |a: &RelativeScale, b: &RelativeScale| {
        let ((behind_a, a), (behind_b, b)) = (doubt(a), doubt(b));
        behind_a.cmp(&behind_b).then(a.total_cmp(&b))
    };
    found().find(RelativeScale::is_observable).or_else(|| found().min_by(least))
}

/// No displacement across the mean heading of its ends, for each sighting and the first one a baseline later.
fn no_side_slip(sightings: &[Sighting], baseline_s: f64) -> Vec<Equation> {
    let equation = |(k, from): (usize, &Sighting)| {
        let to = &sightings[later(sightings, k, baseline_s)?];
        let forward = (from.forward? + to.forward?).try_normalize(1e-6)?;
        let across = from.up.cross(&forward).try_normalize(1e-6)?;
        let (ray, camera) = (to.ray - from.ray, to.camera - from.camera);
        let along = [forward.dot(&ray), forward.dot(&camera)];
        Some(Equation { a: across.dot(&ray), b: across.dot(&camera), along })
    };
    sightings.iter().enumerate().filter_map(equation).collect()
}

/// The position between two others on the straight line between them, in proportion to time: two horizontal components for each sighting and those one
/// and two baselines later.
fn constant_velocity(sightings: &[Sighting], baseline_s: f64) -> Vec<Equation> {
    let equations = |(k, from): (usize, &Sighting)| {
        let between = later(sightings, k, baseline_s)?;
        let (middle, to) = (&sightings[between], &sightings[later(sightings, between, baseline_s)?]);
        let share = (middle.time_s - from.time_s) / (to.time_s - from.time_s);
        let off = |of: fn(&Sighting) -> Vector3<f64>| of(middle) - of(from).lerp(&of(to), share);
        let (ray, camera) = (off(|s| s.ray), off(|s| s.camera));
        let first = from.up.cross(&from.ray).try_normalize(1e-6)?;
        let axes = [first, from.up.cross(&first)];
        Some(axes.map(|axis| Equation { a: axis.dot(&ray), b: axis.dot(&camera), along: [0.0; 2] }))
    };
    sightings.iter().enumerate().filter_map(equations).flatten().collect()
}

/// Index of the first sighting at least a baseline after that of index `from`.
fn later(sightings: &[Sighting], from: usize, baseline_s: f64) -> Option<usize> {
    // Half a millisecond: times of frames are rounded.
    let time_s = sightings[from].time_s + baseline_s - 5e-4;
    sightings.iter().skip(from + 1).position(|s| s.time_s >= time_s).map(|k| from + 1 + k)
}

/// Least squares with a Cauchy kernel, and the standard deviation of the solution. Neighbouring equations share their sightings, and count as
/// `independent` ones.
///
/// Parts of the deviation: that of the residuals; half of the interval between the regression of b on a and the reverse one, between which the solution
/// lies where both have errors (Frisch, 1934); and an error common to all headings, which turns the displacement, and a with it.
fn solve(equations: &[Equation], independent: f64) -> Option<(f64, f64)> {
    if equations.len() < LEAST_EQUATIONS {
        return None;
    }
    let mut weights = vec![1.0; equations.len()];
    let mut scale = 0.0;
    let sum = |weights: &[f64], of: &dyn Fn(&Equation) -> f64| -> f64 {
        equations.iter().zip(weights).map(|(e, w)| w * of(e)).sum()
    };
    for _ in 0..ROUNDS {
        scale = -sum(&weights, &|e| e.a * e.b) / sum(&weights, &|e| e.a * e.a);
        let mut absolute: Vec<f64> = equations.iter().map(|e| (e.a * scale + e.b).abs()).collect();
        let kernel = CAUCHY_SCALE * sigma_from_absolute(&mut absolute)?;
        if !(scale.is_finite() && kernel > 0.0) {
            break;
        }
        let weight = |e: &Equation| 1.0 / (1.0 + ((e.a * scale + e.b) / kernel).powi(2));
        weights = equations.iter().map(weight).collect();
    }
    let [aa, ab, bb] =
        [sum(&weights, &|e| e.a * e.a), sum(&weights, &|e| e.a * e.b), sum(&weights, &|e| e.b * e.b)];
    let squared = sum(&weights, &|e| (e.a * scale + e.b).powi(2));
    let of_residuals = (squared / (aa * independent)).sqrt();
    let reverse = 0.5 * (-bb / ab - scale).abs();
    let of_way = COMMON_HEADING_RAD * sum(&weights, &|e| e.a * (e.along[0] * scale + e.along[1])) / aa;
    let of_rays = COMMON_HEADING_RAD * scale * (sum(&weights, &|e| e.along[0].powi(2)) / aa).sqrt();
    let sigma = of_residuals.hypot(reverse).hypot(of_way).hypot(of_rays);
    (scale.is_finite() && !sigma.is_nan()).then_some((scale, sigma))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FPS: f64 = 10.0;

    /// Five seconds of a vehicle with this position and heading, seen by a camera with this position, in units of the first distance. Heights are zero.
    fn sightings(
        vehicle: impl Fn(f64) -> (Vector3<f64>, f64),
        camera: impl Fn(f64) -> Vector3<f64>,
        noise: f64,
    ) -> (Vec<Sighting>, f64) {
        let unit_m = (vehicle(0.0).0 - camera(0.0)).norm();
        // Periods that share no factor: errors of distance and heading without a trend.
        let error = |k: usize, period: f64| noise * (k as f64 * std::f64::consts::TAU / period).sin();
        let one = |k: usize| {
            let time_s = k as f64 / FPS;
            let (position, heading) = vehicle(time_s);
            let heading = heading + error(k, 3.7);
            Sighting {
                time_s,
                camera: camera(time_s),
                ray: (position - camera(time_s)) * (1.0 + error(k, 5.3)) / unit_m,
                up: -Vector3::y(),
                forward: Some(Vector3::new(heading.sin(), 0.0, heading.cos())),
            }
        };
        ((0..50).map(one).collect(), unit_m)
    }

    /// On a circle of 40 m that begins 25 m ahead and crosses the way of the camera, at 8 m/s.
    fn on_an_arc(time_s: f64) -> (Vector3<f64>, f64) {
        let (radius_m, speed_mps) = (40.0, 8.0);
        let heading = 0.3 + speed_mps * time_s / radius_m;
        let centre = Vector3::new(-2.0 + radius_m * 0.3_f64.cos(), 0.0, 25.0 - radius_m * 0.3_f64.sin());
        (centre + Vector3::new(-heading.cos(), 0.0, heading.sin()) * radius_m, heading)
    }

    fn at(speed_mps: f64) -> impl Fn(f64) -> Vector3<f64> {
        move |time_s| Vector3::new(0.0, 0.0, speed_mps * time_s)
    }

    #[test]
    fn an_arc_determines_the_scale() {
        let (exact, unit_m) = sightings(on_an_arc, at(6.0), 0.0);
        let found = relative_scale(&exact).unwrap();
        assert_eq!(found.assumption, Assumption::Curvilinear);
        assert!((found.scale / unit_m - 1.0).abs() < 1e-9 && found.is_observable(), "{found:?}");
        let (noisy, _) = sightings(on_an_arc, at(6.0), 0.03);
        let found = relative_scale(&noisy).unwrap();
        assert!((found.scale / unit_m - 1.0).abs() < 0.05 && found.is_observable(), "{found:?}");
        assert!((found.scale - unit_m).abs() < 2.0 * found.sigma, "{found:?} for {unit_m}");
    }

    #[test]
    fn single_wrong_sightings_are_outvoted() {
        let (mut sightings, unit_m) = sightings(on_an_arc, at(6.0), 0.01);
        for k in [7, 23, 41] {
            sightings[k].ray *= 1.6;
        }
        let found = relative_scale(&sightings).unwrap();
        assert!((found.scale / unit_m - 1.0).abs() < 0.05, "{found:?} for {unit_m}");
    }

    #[test]
    fn a_vehicle_that_drives_ahead_as_the_camera_does_fits_any_scale() {
        let ahead =
            |speed_mps: f64| move |time_s: f64| (Vector3::new(0.5, 0.0, 20.0 + speed_mps * time_s), 0.0);
        for speed_mps in [10.0, 8.0, -9.0] {
            let (sightings, _) = sightings(ahead(speed_mps), at(10.0), 0.02);
            let found = relative_scale(&sightings).unwrap();
            assert!(!found.is_observable(), "{speed_mps} m/s: {found:?}");
        }
    }

    #[test]
    fn steady_motion_is_seen_by_a_camera_that_brakes() {
        let crossing = |time_s: f64| (Vector3::new(-8.0 + 5.0 * time_s, 0.0, 30.0), 0.0);
        let braking = |time_s: f64| Vector3::new(0.0, 0.0, 12.0 * time_s - 1.2 * time_s * time_s);
        let (mut sightings, unit_m) = sightings(crossing, braking, 0.001);
        sightings.iter_mut().for_each(|s| s.forward = None);
        let found = relative_scale(&sightings).unwrap();
        assert_eq!(found.assumption, Assumption::Steady);
        assert!((found.scale / unit_m - 1.0).abs() < 0.05 && found.is_observable(), "{found:?}");
    }

    #[test]
    fn too_few_sightings_determine_nothing() {
        let (sightings, _) = sightings(on_an_arc, at(6.0), 0.0);
        assert!(relative_scale(&sightings[..2]).is_none() && relative_scale(&[]).is_none());
    }
}
