"""Losses of the vehicle network."""

import torch
from torch.nn import functional

from motorcade_training.vehicle.augment import Sample
from motorcade_training.vehicle.layout import (
    BIN_RAD,
    BODIES,
    HEADING_BINS,
    HEAT_CELLS,
    MEAN_DIMENSIONS_M,
    OUTSIDE,
    SELF_HIDDEN,
    UNKNOWN,
    VISIBLE,
)

#: Standard deviation of the target of a heat map [cells] and of a heading [rad].
HEAT_SIGMA = 0.8
HEADING_SIGMA_RAD = 0.18
#: Weight of a keypoint that does not show: the shape of the vehicle tells roughly where it is.
HIDDEN_WEIGHT = 0.3


def losses(outputs: tuple[torch.Tensor, ...], sample: Sample) -> dict[str, torch.Tensor]:
    """The weighted parts of the loss; their sum is trained."""
    heat, visibility, heading, body, dimensions, _ = outputs
    heat_loss, point_loss = keypoint_losses(heat, sample)
    known = (sample.sights != UNKNOWN).float()
    visible = (sample.sights == VISIBLE).float()
    seen = functional.binary_cross_entropy_with_logits(visibility, visible, reduction="none")
    seen = (seen * known).sum() / known.sum().clamp(min=1)
    bins = heading_targets(sample.heading_rad)
    turned = -(bins * torch.log_softmax(heading, dim=1)).sum(dim=1).mean()
    kind = functional.cross_entropy(body, sample.body, label_smoothing=0.05)
    return {
        "heat": heat_loss,
        "point": 0.5 * point_loss,
        "visibility": seen,
        "heading": 0.5 * turned,
        "body": 0.1 * kind,
        "dimensions": 0.1 * dimension_loss(dimensions, sample.dimensions_m, sample.body),
    }


def keypoint_losses(heat: torch.Tensor, sample: Sample) -> tuple[torch.Tensor, torch.Tensor]:
    """Cross-entropy against a Gaussian around the keypoint, and the L1 distance of the soft-argmax [cells]."""
    # Cell k covers k to k + 1; its centre is k + 0.5.
    place = sample.keypoints * HEAT_CELLS - 0.5
    centres = torch.arange(HEAT_CELLS, dtype=place.dtype, device=place.device)
    along = torch.exp(-0.5 * ((centres - place[..., None]) / HEAT_SIGMA) ** 2)
    target = along[..., 1, :, None] * along[..., 0, None, :]
    mass = target.sum(dim=(2, 3))
    inside = ((place > -1.0) & (place < HEAT_CELLS)).all(dim=2)
    usable = inside & (sample.sights != UNKNOWN) & (mass > 1e-3)
    weight = torch.where(sample.sights == VISIBLE, 1.0, HIDDEN_WEIGHT)
    weight = torch.where(sample.sights == SELF_HIDDEN, HIDDEN_WEIGHT, weight)
    weight = torch.where(sample.sights == OUTSIDE, 0.5 * HIDDEN_WEIGHT, weight) * usable
    target = target.flatten(2) / mass.clamp(min=1e-3)[..., None]
    logits = torch.log_softmax(heat.flatten(2), dim=2)
    total = weight.sum().clamp(min=1)
    cross = (-(target * logits).sum(dim=2) * weight).sum() / total
    share = logits.exp().view(*heat.shape)
    x = (share.sum(dim=2) * centres).sum(dim=2)
    y = (share.sum(dim=3) * centres).sum(dim=2)
    off = (x - place[..., 0]).abs() + (y - place[..., 1]).abs()
    return cross, (off.clamp(max=4) * weight).sum() / total


def heading_targets(heading_rad: torch.Tensor) -> torch.Tensor:
    """(N, bins): a wrapped Gaussian around the heading."""
    off = torch.arange(HEADING_BINS, device=heading_rad.device) * BIN_RAD - heading_rad[:, None]
    off = torch.remainder(off + torch.pi, 2 * torch.pi) - torch.pi
    target = torch.exp(-0.5 * (off / HEADING_SIGMA_RAD) ** 2)
    return target / target.sum(dim=1, keepdim=True)


def dimension_loss(output: torch.Tensor, dimensions_m: torch.Tensor, body: torch.Tensor) -> torch.Tensor:
    """Negative log-likelihood of the log dimensions; what has no keypoints (lorries, buses) counts less."""
    target = torch.log(dimensions_m / torch.tensor(MEAN_DIMENSIONS_M, device=output.device))
    mean, log_variance = output[:, :3], output[:, 3:].clamp(-9.0, 2.0)
    each = 0.5 * ((target - mean) ** 2 * torch.exp(-log_variance) + log_variance).sum(dim=1)
    weight = torch.where(body == len(BODIES) - 1, 0.3, 1.0)
    return (each * weight).sum() / weight.sum()
