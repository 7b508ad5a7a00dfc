"""From the network's outputs to keypoints with covariances and to headings; the reference for the product."""

from dataclasses import dataclass

import numpy as np

from motorcade_training.vehicle.layout import BIN_RAD, HEADING_BINS, HEAT_CELLS

#: Cells on each side of the peak that the local soft-argmax takes in.
REACH = 2


@dataclass
class Keypoints:
    """Of one crop."""

    #: (36, 2) in the crop, 0..1 from edge to edge.
    place: np.ndarray
    #: (36, 2, 2) covariance in crop units, from the second moment of the whole map.
    covariance: np.ndarray
    #: (36,) probability to be seen.
    visibility: np.ndarray


def decode_keypoints(heat: np.ndarray, visibility: np.ndarray) -> Keypoints:
    """`heat` (36, 16, 16) and `visibility` (36,) are logits."""
    flat = heat.reshape(len(heat), -1)
    share = np.exp(flat - flat.max(axis=1, keepdims=True))
    share = (share / share.sum(axis=1, keepdims=True)).reshape(heat.shape)
    centres = (np.arange(HEAT_CELLS) + 0.5) / HEAT_CELLS
    place, covariance = np.zeros((len(heat), 2)), np.zeros((len(heat), 2, 2))
    for k, one in enumerate(share):
        row, column = np.unravel_index(one.argmax(), one.shape)
        rows = slice(max(row - REACH, 0), row + REACH + 1)
        columns = slice(max(column - REACH, 0), column + REACH + 1)
        near = one[rows, columns] / one[rows, columns].sum()
        place[k] = (near.sum(axis=0) @ centres[columns], near.sum(axis=1) @ centres[rows])
        dx, dy = centres - place[k, 0], centres - place[k, 1]
        xy = dy @ one @ dx
        covariance[k] = [[one.sum(axis=0) @ dx**2, xy], [xy, one.sum(axis=1) @ dy**2]]
    return Keypoints(place, covariance, 1 / (1 + np.exp(-visibility)))


@dataclass
class Heading:
    """A hypothesis: angle against the ray through the middle of the box, and its share of the probability."""

    angle_rad: float
    sigma_rad: float
    share: float


def decode_heading(logits: np.ndarray) -> list[Heading]:
    """The best heading and, where there is one at least a quarter turn away, the best rival; `logits` (24,)."""
    share = np.exp(logits - logits.max())
    share /= share.sum()
    bins = np.arange(HEADING_BINS)

    def at(peak: int) -> Heading:
        off = (bins - peak + HEADING_BINS // 2) % HEADING_BINS - HEADING_BINS // 2
        near = np.abs(off) <= 2
        mass = share[near].sum()
        mean = (share[near] * off[near]).sum() / mass
        spread = (share[near] * (off[near] - mean) ** 2).sum() / mass
        angle = (peak + mean) * BIN_RAD
        return Heading(float((angle + np.pi) % (2 * np.pi) - np.pi), float(np.sqrt(spread) * BIN_RAD), float(mass))

    best = int(share.argmax())
    away = np.abs((bins - best + HEADING_BINS // 2) % HEADING_BINS - HEADING_BINS // 2) >= HEADING_BINS // 4
    rival = int(np.where(away, share, -1).argmax())
    return [at(best), at(rival)]
