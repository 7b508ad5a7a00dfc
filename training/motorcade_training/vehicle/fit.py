"""Pose and shape of a vehicle from its keypoints: the shape prior fitted by Gauss-Newton, for evaluation.

Vehicle x forward, y left, z up; camera x right, y down, z forward, level. A heading turns about the vertical: 0 drives away.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from motorcade_training.vehicle.kitti import Camera

ITERATIONS = 12


@dataclass(frozen=True)
class Prior:
    """Mean (K, 3), deformations (B, K, 3), variances (B,) of the first 36 points."""

    mean: np.ndarray
    basis: np.ndarray
    variances: np.ndarray

    @classmethod
    def read(cls, path: Path) -> "Prior":
        """What `motorcade shape export` wrote."""
        told = json.loads(path.read_text())
        count = len(told["keypoints"])
        points = np.array([k["mean_m"] for k in told["keypoints"]])
        basis = np.array([d["displacements_m"] for d in told["basis"]])[:, :count]
        return cls(points, basis, np.array([d["variance"] for d in told["basis"]]))


@dataclass
class Fit:
    """Result of one start."""

    heading_rad: float
    place_m: np.ndarray
    cost: float


def fit(
    prior: Prior, camera: Camera, pixels: np.ndarray, sigma_px: np.ndarray, weight: np.ndarray, heading_rad: float
) -> Fit:
    """From a starting heading; `pixels` (36, 2), `sigma_px` (36,), `weight` (36,) in 0..1."""
    count = len(prior.variances)
    rays = (pixels - [camera.cx, camera.cy]) / camera.focal_px
    spread = np.sqrt(np.average((pixels - np.average(pixels, axis=0, weights=weight)) ** 2, axis=0, weights=weight))
    # The mean car spans about 0.45 m in height and, seen from any side, 0.9 m across (standard deviations).
    depth = camera.focal_px * 0.45 / max(spread[1], 1.0)
    centre = np.average(rays, axis=0, weights=weight)
    state = np.zeros(4 + count)
    state[:4] = [heading_rad, centre[0] * depth, centre[1] * depth + 0.7, depth]
    damping, cost = 1e-3, np.inf
    residual, jacobian = linearised(prior, camera, pixels, state)
    for _ in range(ITERATIONS):
        scale = np.sqrt(robust(residual, sigma_px) * weight)[:, None] / sigma_px[:, None]
        r = (residual * scale).ravel()
        j = (jacobian * scale[..., None]).reshape(-1, len(state))
        normal = j.T @ j
        normal[range(4, 4 + count), range(4, 4 + count)] += 1 / prior.variances
        gradient = j.T @ r
        gradient[4:] += state[4:] / prior.variances
        # The camera stands 1 to 3 m above the road: keeps the height from running away.
        normal[2, 2] += 1 / 0.8**2
        gradient[2] += (state[2] - 1.7) / 0.8**2
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -gradient)
        trial = state + step
        trial[3] = max(trial[3], 1.0)
        there = linearised(prior, camera, pixels, trial)
        new = total(there[0], sigma_px, weight) + (trial[4:] ** 2 / prior.variances).sum()
        if new < cost:
            state, (residual, jacobian), cost, damping = trial, there, new, damping * 0.3
        else:
            damping *= 10
    heading = (state[0] + np.pi) % (2 * np.pi) - np.pi
    return Fit(float(heading), state[1:4], float(cost))


def linearised(prior: Prior, camera: Camera, pixels: np.ndarray, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Residual (36, 2) [px] and its Jacobian (36, 2, 4 + B)."""
    s, c = np.sin(state[0]), np.cos(state[0])
    # Columns: vehicle forward, left, up in the camera.
    rotation = np.array([[-s, -c, 0], [0, 0, -1], [c, -s, 0]])
    turned = np.array([[-c, s, 0], [0, 0, 0], [-s, -c, 0]])
    body = prior.mean + np.tensordot(state[4:], prior.basis, axes=1)
    point = body @ rotation.T + state[1:4]
    z = np.maximum(point[:, 2], 0.3)
    predicted = np.stack([camera.cx + camera.focal_px * point[:, 0] / z, camera.cy + camera.focal_px * point[:, 1] / z], 1)
    # Derivative of the projection (36, 2, 3).
    d = np.zeros((len(z), 2, 3))
    d[:, 0, 0] = d[:, 1, 1] = camera.focal_px / z
    d[:, 0, 2] = -camera.focal_px * point[:, 0] / z**2
    d[:, 1, 2] = -camera.focal_px * point[:, 1] / z**2
    jacobian = np.zeros((len(z), 2, len(state)))
    jacobian[:, :, 0] = np.einsum("kij,kj->ki", d, body @ turned.T)
    jacobian[:, :, 1:4] = d
    jacobian[:, :, 4:] = np.einsum("kij,bkj->kib", d, prior.basis @ rotation.T)
    return predicted - pixels, jacobian


def robust(residual: np.ndarray, sigma_px: np.ndarray) -> np.ndarray:
    """Weights of Geman-McClure at three sigma."""
    return 1 / (1 + (residual**2).sum(axis=1) / (9 * sigma_px**2)) ** 2


def total(residual: np.ndarray, sigma_px: np.ndarray, weight: np.ndarray) -> float:
    """Robust cost."""
    squared = (residual**2).sum(axis=1) / (9 * sigma_px**2)
    return float((9 * weight * squared / (1 + squared)).sum())
