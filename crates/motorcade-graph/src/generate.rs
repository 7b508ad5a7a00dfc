//! Generated drives: a camera car and the vehicles around it, for tests and benchmarks.

use motorcade_geometry::lie::se3;
use nalgebra::{Isometry3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::GraphError;
use crate::factors::Between;
use crate::graph::Graph;
use crate::ids::VariableId;

/// A drive to generate.
#[derive(Clone, Debug)]
pub struct DriveOptions {
    /// Frames.
    pub frames: usize,
    /// Vehicles seen in every frame; each is replaced by a new one after [`track_length`](Self::track_length).
    pub vehicles: usize,
    /// Frames a vehicle is followed.
    pub track_length: usize,
    /// Frames of a round trip; the camera meets its old path after each and closes loops there. 0: never.
    pub lap: usize,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for DriveOptions {
    fn default() -> Self {
        Self { frames: 1000, vehicles: 4, track_length: 40, lap: 0, seed: 1 }
    }
}

/// A generated drive.
#[derive(Debug)]
pub struct Drive {
    /// Poses chained from noisy measurements; the first is fixed.
    pub graph: Graph,
    /// True pose of every variable, by id.
    pub truth: Vec<Isometry3<f64>>,
}

/// Standard deviations \[rad, m\] of one kind of measurement.
#[derive(Clone, Copy)]
struct Noise {
    rotation: f64,
    position: f64,
}

const CAMERA: Noise = Noise { rotation: 0.002, position: 0.03 };
const SIGHTING: Noise = Noise { rotation: 0.05, position: 0.3 };
const VEHICLE: Noise = Noise { rotation: 0.01, position: 0.08 };

struct Maker {
    graph: Graph,
    truth: Vec<Isometry3<f64>>,
    random: ChaCha8Rng,
}

impl Maker {
    /// Box–Muller.
    fn normal(&mut self) -> f64 {
        let (u, v): (f64, f64) = (self.random.random(), self.random.random());
        (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    fn measure(&mut self, first: &Isometry3<f64>, second: &Isometry3<f64>, noise: Noise) -> Isometry3<f64> {
        let sigma =
            [noise.rotation, noise.rotation, noise.rotation, noise.position, noise.position, noise.position];
        let error = Vector6::from_fn(|k, _| sigma[k] * self.normal());
        first.inv_mul(second) * se3::exp(&error)
    }

    /// Adds a variable started at `base · measurement` and its factor.
    fn chain(
        &mut self,
        base: VariableId,
        truth: Isometry3<f64>,
        noise: Noise,
    ) -> Result<VariableId, GraphError> {
        let motion = self.measure(&self.truth[base.index()].clone(), &truth, noise);
        let start = self.graph.values().get::<Isometry3<f64>>(base)? * motion;
        let id = self.graph.add_variable(start);
        self.truth.push(truth);
        self.add(base, id, motion, noise)?;
        Ok(id)
    }

    fn join(&mut self, first: VariableId, second: VariableId, noise: Noise) -> Result<(), GraphError> {
        let (a, b) = (self.truth[first.index()], self.truth[second.index()]);
        let motion = self.measure(&a, &b, noise);
        self.add(first, second, motion, noise)
    }

    fn add(
        &mut self,
        first: VariableId,
        second: VariableId,
        motion: Isometry3<f64>,
        noise: Noise,
    ) -> Result<(), GraphError> {
        let (r, p) = (noise.rotation.powi(-2), noise.position.powi(-2));
        let information = Matrix6::from_diagonal(&Vector6::new(r, r, r, p, p, p));
        self.graph.add_factor(Between::new(first, second, motion, information)?)?;
        Ok(())
    }
}

/// Camera pose along a gently winding road, 1 m a frame; laps are circles.
fn camera(frame: usize, lap: usize) -> Isometry3<f64> {
    let s = frame as f64;
    if lap > 0 {
        let angle = std::f64::consts::TAU * s / lap as f64;
        let radius = lap as f64 / std::f64::consts::TAU;
        let position = Translation3::new(radius * angle.sin(), radius * (1.0 - angle.cos()), 0.0);
        return Isometry3::from_parts(position, UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle));
    }
    let yaw = 0.5 * (s / 60.0).sin();
    let position = Translation3::new(s, 30.0 * (1.0 - (s / 60.0).cos()), 0.2 * (s / 25.0).sin());
    Isometry3::from_parts(position, UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw))
}

/// A vehicle ahead of the camera that drifts along its lane.
fn vehicle(frame: usize, lane: usize, age: usize, lap: usize) -> Isometry3<f64> {
    let side = if lane.is_multiple_of(2) { 3.0 } else { -3.0 };
    let ahead = 8.0 + 7.0 * lane as f64 + 0.2 * age as f64;
    camera(frame, lap)
        * Isometry3::from_parts(
            Translation3::new(ahead, side, -1.0),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.01 * age as f64),
        )
}

/// Generates a drive: for every frame, camera to the three frames before (odometry over a small window), camera to
/// every vehicle, vehicle to itself a frame before, and every vehicle of the frame before seen from the camera.
pub fn drive(options: &DriveOptions) -> Result<Drive, GraphError> {
    let random = ChaCha8Rng::seed_from_u64(options.seed);
    let mut maker = Maker { graph: Graph::new(), truth: Vec::new(), random };
    let mut cameras: Vec<VariableId> = Vec::new();
    let mut tracks: Vec<Option<VariableId>> = vec![None; options.vehicles];
    for frame in 0..options.frames {
        let truth = camera(frame, options.lap);
        let id = match cameras.last() {
            Some(&last) => maker.chain(last, truth, CAMERA)?,
            None => {
                maker.truth.push(truth);
                maker.graph.add_variable(truth)
            }
        };
        for back in [2, 3] {
            if let Some(&other) = cameras.len().checked_sub(back).and_then(|k| cameras.get(k)) {
                maker.join(other, id, CAMERA)?;
            }
        }
        if options.lap > 0 && frame >= options.lap && frame.is_multiple_of(5) {
            maker.join(cameras[frame - options.lap], id, CAMERA)?;
        }
        cameras.push(id);
        for lane in 0..options.vehicles {
            let shifted = frame + lane * options.track_length / options.vehicles.max(1);
            let age = shifted % options.track_length.max(1);
            let seen = maker.chain(id, vehicle(frame, lane, age, options.lap), SIGHTING)?;
            if let Some(before) = tracks[lane].filter(|_| age > 0) {
                maker.join(before, seen, VEHICLE)?;
                maker.join(id, before, SIGHTING)?;
            }
            tracks[lane] = Some(seen);
        }
    }
    if let Some(&first) = cameras.first() {
        maker.graph.fix(first)?;
    }
    Ok(Drive { graph: maker.graph, truth: maker.truth })
}
