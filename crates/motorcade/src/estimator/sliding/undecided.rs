//! Vehicles that may stand or move.

use motorcade_geometry::{Camera, Pose, World};
use motorcade_odometry::EgoTrajectory;
use motorcade_vehicles::{KinematicStateOptions, VehicleTrajectory};

use crate::relative::add_camera;

/// Vehicles that are outside the graph of a window: there they would be one place, or drive, as if it were certain.
pub(super) struct Undecided {
    vehicles: Vec<VehicleTrajectory>,
    /// Cameras of the window before its graph.
    cameras: Vec<Pose<World, Camera>>,
}

impl Undecided {
    /// Takes them out of the vehicles of a window.
    pub(super) fn out_of(
        vehicles: &mut Vec<VehicleTrajectory>,
        ego: &EgoTrajectory,
        options: &KinematicStateOptions,
    ) -> Self {
        let undecided = |v: &mut VehicleTrajectory| options.is_undecided(v.p_moving);
        let vehicles = vehicles.extract_if(.., undecided).collect();
        Self { vehicles, cameras: ego.frames.iter().map(|f| f.world_from_camera).collect() }
    }

    /// Puts them back, moved with the cameras.
    pub(super) fn back_into(mut self, vehicles: &mut Vec<VehicleTrajectory>, ego: &EgoTrajectory) {
        for state in self.vehicles.iter_mut().flat_map(|v| &mut v.states) {
            if let (Some(before), Some(after)) = (self.cameras.get(state.frame), ego.frames.get(state.frame))
            {
                state.world_from_vehicle =
                    after.world_from_camera * (before.inverse() * state.world_from_vehicle);
            }
        }
        add_camera(ego, &mut self.vehicles);
        vehicles.append(&mut self.vehicles);
        vehicles.sort_by_key(|v| v.id);
    }
}

#[cfg(test)]
mod tests {
    use motorcade_geometry::Pose;
    use motorcade_odometry::EgoTrajectory;
    use motorcade_perception::VehicleClass;
    use motorcade_vehicles::{KinematicStateOptions, VehicleTrajectory, size_prior};
    use nalgebra::{Matrix3, Vector6};

    use super::Undecided;
    use crate::finite::tests::{frame, state};

    #[test]
    fn what_is_undecided_leaves_the_graph_and_comes_back_with_its_camera() {
        let vehicle = |(id, p_moving): (usize, f64)| VehicleTrajectory {
            id,
            class: VehicleClass::Car,
            size: size_prior(VehicleClass::Car).mean,
            size_covariance: Matrix3::identity(),
            size_by_road: None,
            p_moving,
            states: vec![state(0.25)],
        };
        let mut ego = EgoTrajectory { frames: vec![frame()], height_m: 1.65, noise: Vec::new() };
        let mut vehicles: Vec<_> =
            [(1, 0.02), (2, 0.4), (3, 0.7), (4, 0.99)].into_iter().map(vehicle).collect();
        let before = state(0.25).world_from_vehicle;
        let undecided = Undecided::out_of(&mut vehicles, &ego, &KinematicStateOptions::default());
        assert_eq!(vehicles.iter().map(|v| v.id).collect::<Vec<_>>(), [1, 4]);
        let moved = Pose::exp(&Vector6::new(0.0, 0.1, 0.0, 1.0, 0.0, 0.5));
        let camera = ego.frames[0].world_from_camera;
        ego.frames[0].world_from_camera = moved * camera;
        undecided.back_into(&mut vehicles, &ego);
        assert_eq!(vehicles.iter().map(|v| v.id).collect::<Vec<_>>(), [1, 2, 3, 4]);
        for v in &vehicles[1..3] {
            let off = (moved * before).inverse() * v.states[0].world_from_vehicle;
            assert!(off.log().norm() < 1e-12);
            // The camera's covariance is added.
            assert!(v.states[0].covariance[(3, 3)] > state(0.25).covariance[(3, 3)]);
        }
        assert!(vehicles[0].states[0].world_from_vehicle == before);
    }
}
