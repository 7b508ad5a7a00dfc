"""Estimates of one frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class VehicleEstimate:
    """A vehicle in the newest frame."""

    id: int
    """Identity, the same over the drive."""
    class_name: str
    """Car, Van, Truck, Bus or Motorcycle."""
    size_m: NDArray[np.float64]
    """Length, width, height [m]; shape [3]."""
    size_sigma_m: NDArray[np.float64]
    """Their standard deviations [m]; shape [3]."""
    p_moving: float
    """Probability that it moves."""
    pose: NDArray[np.float64] = field(repr=False)
    """world_from_vehicle [m]; shape [4, 4]."""
    covariance: NDArray[np.float64] = field(repr=False)
    """Covariance of the pose, tangent [ω, ν] of the vehicle; shape [6, 6]."""
    speed_mps: float
    """Speed over the road, forward positive [m/s]."""
    speed_sigma_mps: float
    """Its standard deviation [m/s]."""
    yaw_rate_radps: float
    """Yaw rate, left positive [rad/s]."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Camera, road and vehicles in the newest frame, from it and the frames before it alone."""

    frame: int
    """Number of the frame."""
    time_ns: int
    """Time [ns]."""
    status: str
    """tracked, standstill, bridged or filled_in."""
    pose: NDArray[np.float64] = field(repr=False)
    """world_from_camera [m]; shape [4, 4]."""
    covariance: NDArray[np.float64] = field(repr=False)
    """Covariance of the pose, tangent [ω, ν] of the camera; shape [6, 6]."""
    speed_mps: float
    """Speed of the camera over the last interval [m/s]; 0 in the first frame."""
    road_normal: NDArray[np.float64] = field(repr=False)
    """Unit normal of the road towards the camera, in the camera; shape [3]."""
    vehicles: list[VehicleEstimate]
    """Vehicles seen in the frame, by identity."""

    @property
    def time_s(self) -> float:
        """Time [s]."""
        return self.time_ns * 1e-9

    def camera_from_vehicle(self, vehicle: VehicleEstimate) -> NDArray[np.float64]:
        """Pose of a vehicle in the camera [m]; shape [4, 4]."""
        import numpy as np

        pose: NDArray[np.float64] = np.linalg.inv(self.pose) @ vehicle.pose
        return pose


def from_native(data: dict[str, Any]) -> Estimate:
    """An estimate of what the native part gives."""
    vehicles = [VehicleEstimate(**vehicle) for vehicle in data["vehicles"]]
    return Estimate(**{**data, "vehicles": vehicles})
