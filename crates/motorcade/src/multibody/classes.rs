//! Classes of edges, and the factor each class' covariances are multiplied by.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use motorcade_graph::{Cauchy, Dcs, GemanMcClure, Huber, Kernel, Loss};
use motorcade_vehicles::Source;

use super::{GraphKernel, GraphOptions};

/// Edges whose covariances err alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeClass {
    /// Camera–camera.
    Odometry,
    /// Camera–vehicle, from a box.
    Box,
    /// Camera–vehicle, from keypoints.
    Keypoints,
    /// Camera–vehicle, from a pose that was given.
    External,
    /// Steady motion of a vehicle.
    SteadyMotion,
    /// No side slip of a vehicle.
    NoSideSlip,
}

impl EdgeClass {
    /// All, in a fixed order.
    pub const ALL: [Self; 6] =
        [Self::Odometry, Self::Box, Self::Keypoints, Self::External, Self::SteadyMotion, Self::NoSideSlip];

    /// The class of what a source says.
    pub(crate) fn of(source: Source) -> Self {
        match source {
            Source::Keypoints => Self::Keypoints,
            Source::External => Self::External,
            Source::Box | Source::Predicted => Self::Box,
        }
    }

    /// True for what a frame says of a vehicle.
    pub(crate) fn is_sighting(self) -> bool {
        matches!(self, Self::Box | Self::Keypoints | Self::External)
    }
}

/// The factor on the variances of each class; clones share them.
#[derive(Clone, Debug)]
pub(crate) struct ClassScales([Arc<AtomicU64>; 6]);

impl Default for ClassScales {
    fn default() -> Self {
        Self(std::array::from_fn(|_| Arc::new(AtomicU64::new(1.0_f64.to_bits()))))
    }
}

impl ClassScales {
    pub(crate) fn get(&self, class: EdgeClass) -> f64 {
        f64::from_bits(self.0[class as usize].load(Ordering::Relaxed))
    }
    /// In the order of [`EdgeClass::ALL`].
    pub(crate) fn all(&self) -> [f64; 6] {
        EdgeClass::ALL.map(|class| self.get(class))
    }
    /// Not while a solver runs.
    pub(crate) fn set(&self, class: EdgeClass, variance_factor: f64) {
        self.0[class as usize].store(variance_factor.to_bits(), Ordering::Relaxed);
    }
    /// The kernel of a class at its factor.
    pub(crate) fn kernel(&self, class: EdgeClass, options: &GraphOptions) -> ClassKernel {
        ClassKernel {
            kernel: kernel_of(class, options),
            c: options.kernel_scale,
            factor: self.0[class as usize].clone(),
        }
    }
}

/// The kernel of a class: sightings err with heavy tails.
pub(crate) fn kernel_of(class: EdgeClass, options: &GraphOptions) -> GraphKernel {
    if class.is_sighting() { options.kernel } else { GraphKernel::None }
}

/// `ρ(s / f)` for variances multiplied by f.
#[derive(Clone, Debug)]
pub(crate) struct ClassKernel {
    kernel: GraphKernel,
    c: f64,
    factor: Arc<AtomicU64>,
}

impl Kernel for ClassKernel {
    fn loss(&self, s: f64) -> Loss {
        let factor = f64::from_bits(self.factor.load(Ordering::Relaxed));
        let loss = self.kernel.loss(self.c, s / factor);
        Loss { cost: loss.cost, weight: loss.weight / factor }
    }
}

impl GraphKernel {
    /// ρ and its slope at a squared whitened residual, for a scale of c standard deviations.
    pub(crate) fn loss(self, c: f64, s: f64) -> Loss {
        match self {
            Self::None => Loss { cost: s, weight: 1.0 },
            Self::Huber => Huber { c }.loss(s),
            Self::Cauchy => Cauchy { c }.loss(s),
            Self::GemanMcClure => GemanMcClure { c }.loss(s),
            Self::Dcs => Dcs { phi: c * c }.loss(s),
        }
    }
}
