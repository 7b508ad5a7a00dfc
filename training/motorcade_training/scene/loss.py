"""Loss of the scene network: quality-aware focal loss for scores, GIoU for boxes, cross entropy and Dice for the road."""

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

from motorcade_training.scene.assign import assign, cells
from motorcade_training.scene.dataset import Batch

BOX_WEIGHT, ROAD_WEIGHT, DICE_WEIGHT = 3.5, 2.0, 0.5


@dataclass
class Losses:
    """Parts of the loss, each with its weight."""

    score: Tensor
    box: Tensor
    road: Tensor

    def total(self) -> Tensor:
        """Their sum."""
        return self.score + self.box + self.road


def flatten(heads: list[tuple[Tensor, Tensor]]) -> tuple[Tensor, Tensor]:
    """Logits [B, M, C] and log distances [B, M, 4] of all strides, in the order of `cells`."""
    flat = lambda x: x.flatten(2).transpose(1, 2)  # noqa: E731
    return torch.cat([flat(s) for s, _ in heads], 1).float(), torch.cat([flat(e) for _, e in heads], 1).float()


def decode(edges: Tensor, centres: Tensor, strides: Tensor) -> Tensor:
    """Boxes [..., M, 4] px from log distances in strides."""
    distance = edges.clamp(max=6.0).exp() * strides[:, None]
    return torch.cat([centres - distance[..., :2], centres + distance[..., 2:]], -1)


def giou(a: Tensor, b: Tensor) -> Tensor:
    """Generalised IoU of boxes in pairs, [N] (Rezatofighi et al., CVPR 2019)."""
    common = (torch.minimum(a[:, 2:], b[:, 2:]) - torch.maximum(a[:, :2], b[:, :2])).clamp(min=0).prod(1)
    hull = (torch.maximum(a[:, 2:], b[:, 2:]) - torch.minimum(a[:, :2], b[:, :2])).prod(1)
    union = (a[:, 2:] - a[:, :2]).prod(1) + (b[:, 2:] - b[:, :2]).prod(1) - common
    return common / union.clamp(min=1e-6) - (hull - union) / hull.clamp(min=1e-6)


def scene_loss(heads: list[tuple[Tensor, Tensor]], road: Tensor, batch: Batch) -> Losses:
    """Losses of raw outputs of the network; the batch is on the outputs' device."""
    height, width = batch.images.shape[2:]
    centres, strides = cells(height, width, road.device)
    logits, edges = flatten(heads)
    boxes = decode(edges, centres, strides)
    probability = logits.sigmoid()
    target = torch.zeros_like(logits)
    weight = torch.ones_like(logits)
    predicted, wanted, quality = [], [], []
    for b in range(len(batch.boxes)):
        t = assign(probability[b].detach(), boxes[b].detach(), centres, strides, batch.boxes[b], batch.kinds[b])
        positive = torch.nonzero(t.box >= 0).flatten()
        target[b, positive, batch.kinds[b][t.box[positive]]] = t.quality[positive]
        weight[b, t.ignored] = 0
        predicted.append(boxes[b, positive])
        wanted.append(batch.boxes[b][t.box[positive]])
        quality.append(t.quality[positive])
    # Varifocal loss (Zhang et al., CVPR 2021).
    focal = torch.where(target > 0, target, 0.75 * probability.detach() ** 2)
    score = F.binary_cross_entropy_with_logits(logits, target, focal * weight, reduction="sum")
    qualities = torch.cat(quality)
    norm = qualities.sum().clamp(min=1.0)
    box = (qualities * (1 - giou(torch.cat(predicted), torch.cat(wanted)))).sum()
    return Losses(score / norm, BOX_WEIGHT * box / norm, road_loss(road[:, 0].float(), batch.road))


def road_loss(logits: Tensor, target: Tensor) -> Tensor:
    """Cross entropy and Dice over the known pixels; logits and target [B, h, w]."""
    known = (target >= 0).float()
    target = target.clamp(min=0)
    entropy = F.binary_cross_entropy_with_logits(logits, target, known, reduction="sum") / known.sum().clamp(min=1)
    probability = logits.sigmoid() * known
    dice = 1 - (2 * (probability * target).sum() + 1) / ((probability + target * known).sum() + 1)
    return ROAD_WEIGHT * entropy + DICE_WEIGHT * dice
