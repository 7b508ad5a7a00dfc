"""KITTI tracking labels and pictures, to judge by; never trained on."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Camera:
    """Pinhole camera; `offset_m` moves points of rectified cam0 into it."""

    focal_px: float
    cx: float
    cy: float
    offset_m: np.ndarray


@dataclass(frozen=True)
class Label:
    """One labelled vehicle in one frame."""

    frame: int
    track: int
    kind: str
    truncated: float
    occluded: int
    box: tuple[float, float, float, float]
    #: Length, width, height.
    size_m: tuple[float, float, float]
    #: Bottom centre in the camera.
    place_m: np.ndarray
    #: Against the camera's axis: 0 drives straight away, positive turns to the left.
    heading_rad: float


def read_camera(calibration: Path, index: int) -> Camera:
    """Camera `index` of a calibration file."""
    for line in calibration.read_text().splitlines():
        name, _, rest = line.partition(" ")
        if name.rstrip(":") == f"P{index}":
            p = np.array([float(v) for v in rest.split()]).reshape(3, 4)
            return Camera(p[0, 0], p[0, 2], p[1, 2], np.linalg.solve(p[:, :3], p[:, 3]))
    raise ValueError(f"{calibration}: no P{index}")


def read_labels(path: Path, camera: Camera) -> list[Label]:
    """Cars and vans of a label file."""
    labels = []
    for line in path.read_text().splitlines():
        w = line.split()
        if w[2] not in ("Car", "Van"):
            continue
        v = [float(x) for x in w[3:17]]
        height, width, length = v[7:10]
        ry = v[13]
        # KITTI turns about y (down) from x: forward is (cos ry, 0, -sin ry).
        heading = np.arctan2(-np.cos(ry), -np.sin(ry))
        place = np.array(v[10:13]) + camera.offset_m
        labels.append(
            Label(
                int(w[0]), int(w[1]), w[2], v[0], int(v[1]), tuple(v[3:7]), (length, width, height), place, float(heading)
            )
        )
    return labels


def ray_rad(camera: Camera, box: tuple[float, float, float, float]) -> float:
    """Direction of the ray through the middle of a box, positive to the left."""
    return float(-np.arctan((0.5 * (box[0] + box[2]) - camera.cx) / camera.focal_px))
