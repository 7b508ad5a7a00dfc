"""Keypoints on rendered crops that were not trained on: how near they come, and what the heat maps' spread is worth.

The variance of a coordinate is told as `gain` x second moment + `floor`, in units of the crop's extent along it.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from motorcade_training.vehicle.augment import NONE, Strength, augment
from motorcade_training.vehicle.data import CropSet
from motorcade_training.vehicle.decode import decode_keypoints
from motorcade_training.vehicle.layout import MARGIN, VISIBLE


@dataclass
class Errors:
    """Of the coordinates of keypoints that show, each an array of equal length."""

    #: Signed distance [share of the crop].
    off: np.ndarray
    #: Second moment of the heat map [share of the crop squared].
    moment: np.ndarray
    #: Distance of the keypoint [share of the box]; one for two coordinates.
    distance: np.ndarray
    #: Predicted probability to be seen and whether it is, of all keypoints.
    visibility: np.ndarray
    seen: np.ndarray


def measure(infer, folder: Path, count: int, strength: Strength = NONE) -> Errors:
    """On the last `count` crops of a folder."""
    crops = CropSet([folder])
    off, moment, distance, visibility, seen = [], [], [], [], []
    for start in range(max(0, len(crops) - count), len(crops), 64):
        indices = np.arange(start, min(start + 64, len(crops)))
        sample = augment(crops.batch(indices), strength, torch.Generator().manual_seed(start))
        heat, shown, *_ = infer(sample.input.numpy())
        for i in range(len(indices)):
            found = decode_keypoints(heat[i], shown[i])
            truth, sight = sample.keypoints[i].numpy(), sample.sights[i].numpy()
            visibility.append(found.visibility)
            seen.append(sight == VISIBLE)
            rows = (sight == VISIBLE) & ((truth > 0) & (truth < 1)).all(axis=1)
            error = found.place[rows] - truth[rows]
            off.append(error.ravel())
            moment.append(found.covariance[rows][:, [0, 1], [0, 1]].ravel())
            distance.append(np.hypot(*error.T) * MARGIN)
    return Errors(*(np.concatenate(parts) for parts in (off, moment, distance, visibility, seen)))


def calibrated(errors: Errors, bins: int = 12) -> tuple[float, float]:
    """`gain` and `floor` from robust variances in bins of equal size over the second moment."""
    order = np.array_split(np.argsort(errors.moment), bins)
    moment = np.array([errors.moment[rows].mean() for rows in order])
    variance = np.array([(1.4826 * np.median(np.abs(errors.off[rows]))) ** 2 for rows in order])
    # Relative errors count: weights of one over the variance.
    design = np.stack([moment, np.ones(bins)], axis=1) / variance[:, None]
    gain, floor = np.linalg.lstsq(design, np.ones(bins), rcond=None)[0]
    return float(max(gain, 0.0)), float(max(floor, 1e-6))


def report(errors: Errors) -> list[str]:
    """Lines to print."""
    gain, floor = calibrated(errors)
    sigma = np.sqrt(gain * errors.moment + floor)
    within = [(np.abs(errors.off) < k * sigma).mean() for k in (1, 2, 3)]
    right = ((errors.visibility > 0.5) == errors.seen).mean()
    return [
        f"rendered keypoints that show: {len(errors.distance)}, median distance {np.median(errors.distance):.4f} of the box,"
        f" within 0.1 of the box {100 * (errors.distance < 0.1).mean():.1f} %",
        f"visibility right: {100 * right:.1f} %",
        f"variance of a coordinate = {gain:.3f} x moment + {floor:.2e} [shares of the crop squared];"
        f" within 1, 2, 3 sigma: {100 * within[0]:.0f}, {100 * within[1]:.0f}, {100 * within[2]:.0f} %",
    ]
