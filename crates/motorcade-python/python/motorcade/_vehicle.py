"""One vehicle of a drive."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Vehicle:
    """A vehicle of a drive: m states, one a frame from the first measurement to the last."""

    id: int
    """Identity, the same over the drive and in all files."""
    class_name: str
    """Car, Van, Truck, Bus or Motorcycle."""
    size_m: NDArray[np.float64]
    """Length, width, height [m]; shape [3]."""
    size_sigma_m: NDArray[np.float64]
    """Their standard deviations [m]; shape [3]."""
    p_moving: float
    """Probability that it moves during the track."""
    rows: NDArray[np.int64]
    """Rows of the drive's arrays that belong to the states; shape [m]."""
    frames: NDArray[np.int64]
    """Numbers of those frames in the input; shape [m]."""
    times_s: NDArray[np.float64]
    """Times [s]; shape [m]."""
    poses: NDArray[np.float64] = field(repr=False)
    """world_from_vehicle [m]; shape [m, 4, 4]. x forward, y left, z up, origin on the road below the centre."""
    covariances: NDArray[np.float64] = field(repr=False)
    """Covariances of the poses, tangent [ω, ν] of the vehicle; shape [m, 6, 6]. Of a drive that was loaded only the variances
    of heading, forward, left and up are known; the rest is NaN."""
    speeds_mps: NDArray[np.float64] = field(repr=False)
    """Speed over the road, forward positive [m/s]; shape [m]."""
    speed_sigmas_mps: NDArray[np.float64] = field(repr=False)
    """Its standard deviation [m/s]; shape [m]."""
    yaw_rates_radps: NDArray[np.float64] = field(repr=False)
    """Yaw rate, left positive [rad/s]; shape [m]."""
    sources: NDArray[np.str_] = field(repr=False)
    """box, keypoints, given or predicted; shape [m]."""
    scores: NDArray[np.float64] = field(repr=False)
    """Score of the detection, 0 where predicted; shape [m]."""
    boxes_px: NDArray[np.float64] | None = field(repr=False, default=None)
    """x1, y1, x2, y2 in the image [px], NaN where there is none; shape [m, 4]. None for a drive that was loaded."""

    @property
    def moving(self) -> bool:
        """True when it more probably moves than not."""
        return self.p_moving > 0.5

    @property
    def positions_m(self) -> NDArray[np.float64]:
        """Positions in the world [m]; shape [m, 3]."""
        positions: NDArray[np.float64] = self.poses[:, :3, 3]
        return positions

    def __len__(self) -> int:
        return len(self.rows)


def from_native(data: dict[str, Any], tracks: dict[str, NDArray[Any]]) -> Vehicle:
    """A vehicle of what the native part gives and of its rows in tracks.csv."""
    import numpy as np

    own = {name: column[tracks["id"] == data["id"]] for name, column in tracks.items()}
    sizes = [own[f"sigma_{side}_m"][:1] for side in ("length", "width", "height")]
    return Vehicle(
        id=int(data["id"]),
        class_name=data["class_name"],
        size_m=data["size_m"],
        size_sigma_m=data.get("size_sigma_m", np.concatenate(sizes)),
        p_moving=float(data["p_moving"]),
        rows=data["rows"],
        frames=own["frame"],
        times_s=own["time_s"],
        poses=data["poses"],
        covariances=data["covariances"] if "covariances" in data else _known_variances(own),
        speeds_mps=own["speed_mps"],
        speed_sigmas_mps=own["sigma_speed_mps"],
        yaw_rates_radps=own["yaw_rate_radps"],
        sources=own["source"],
        scores=own["score"],
        boxes_px=data.get("boxes_px"),
    )


def _known_variances(own: dict[str, NDArray[Any]]) -> NDArray[np.float64]:
    import numpy as np

    out = np.full((len(own["frame"]), 6, 6), np.nan)
    names = ("sigma_heading_rad", "sigma_forward_m", "sigma_left_m", "sigma_up_m")
    for k, name in zip((2, 3, 4, 5), names):
        out[:, k, k] = own[name] ** 2
    return out
