//! Classes of edges, and the groups of the graph in which their covariances are scaled.

use motorcade_graph::{Graph, GroupId, RobustKernel};
use motorcade_vehicles::Source;

use crate::options::GraphOptions;

/// Edges with errors of the same kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeClass {
    /// Camera–camera.
    Odometry,
    /// Camera–vehicle, from a box.
    Box,
    /// Camera–vehicle, from keypoints.
    Keypoints,
    /// Camera–vehicle, from a pose of a file.
    #[serde(rename = "given")]
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

    /// Classes of camera–vehicle edges.
    pub(crate) const MEASUREMENTS: [Self; 3] = [Self::Box, Self::Keypoints, Self::External];

    /// The class of a camera–vehicle edge.
    pub(crate) fn of(source: Source) -> Self {
        match source {
            Source::Keypoints => Self::Keypoints,
            Source::External => Self::External,
            Source::Box | Source::Predicted => Self::Box,
        }
    }

    /// True for camera–vehicle edges.
    pub(crate) fn is_measurement(self) -> bool {
        Self::MEASUREMENTS.contains(&self)
    }

    /// The robust kernel at an interval between frames: camera–vehicle edges have heavy-tailed errors. The scale belongs to the
    /// covariances as inflated at the reference interval; at others it is such that the same error of a frame has the same
    /// weight.
    pub(crate) fn kernel(self, interval_s: f64, options: &GraphOptions) -> RobustKernel {
        if !self.is_measurement() {
            return RobustKernel::None;
        }
        let reference = options.inflation(options.advanced.reference_interval_s);
        let scale = options.advanced.kernel_scale * (reference / options.inflation(interval_s)).sqrt();
        options.advanced.kernel.at_scale(scale)
    }
}

/// Groups of a graph, one for each class of camera–vehicle edges.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClassGroups([GroupId; 3]);

impl ClassGroups {
    pub(crate) fn new(graph: &mut Graph) -> Self {
        Self(EdgeClass::MEASUREMENTS.map(|_| graph.add_group()))
    }

    /// The group of a class; `None` where covariances are not scaled.
    pub(crate) fn of(&self, class: EdgeClass) -> Option<GroupId> {
        let at = EdgeClass::MEASUREMENTS.iter().position(|c| *c == class)?;
        self.0.get(at).copied()
    }

    /// Factors on the variances of all classes of camera–vehicle edges.
    pub(crate) fn factors(&self, graph: &Graph) -> [f64; 3] {
        self.0.map(|group| graph.scale(group).variance)
    }
}
