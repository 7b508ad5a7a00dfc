"""Cells of the box heads that learn a vehicle: task-aligned assignment (Feng et al., TOOD, ICCV 2021)."""

from dataclasses import dataclass

import torch
from torch import Tensor

from motorcade_training.scene.model import BOX_STRIDES

#: Cells a vehicle is learned by.
TOP = 9
#: Alignment is score^SCORE_POWER x IoU^IOU_POWER.
SCORE_POWER, IOU_POWER = 0.5, 4.0
#: Larger side of the boxes each stride learns [px].
SIDES_PX = {8: (0.0, 120.0), 16: (56.0, 1e9)}


@dataclass
class Targets:
    """Targets of the cells of one image."""

    box: Tensor  #: i64 [M], index of the box, -1 for none
    quality: Tensor  #: f32 [M], score to learn
    ignored: Tensor  #: bool [M], neither vehicle nor background


def cells(height: int, width: int, device: torch.device) -> tuple[Tensor, Tensor]:
    """Centres [M, 2] px and strides [M] px of all cells, stride by stride, row by row."""
    centres, strides = [], []
    for stride in BOX_STRIDES:
        y = (torch.arange(height // stride, device=device) + 0.5) * stride
        x = (torch.arange(width // stride, device=device) + 0.5) * stride
        grid = torch.stack(torch.meshgrid(y, x, indexing="ij"), -1).reshape(-1, 2)
        centres.append(grid.flip(1))
        strides.append(torch.full((len(grid),), float(stride), device=device))
    return torch.cat(centres), torch.cat(strides)


def pair_iou(a: Tensor, b: Tensor) -> Tensor:
    """IoU of each pair, [len(a), len(b)]."""
    low, high = torch.maximum(a[:, None, :2], b[None, :, :2]), torch.minimum(a[:, None, 2:], b[None, :, 2:])
    common = (high - low).clamp(min=0).prod(2)
    sizes = [(x[:, 2:] - x[:, :2]).clamp(min=0).prod(1) for x in (a, b)]
    return common / (sizes[0][:, None] + sizes[1][None] - common).clamp(min=1e-6)


def inside(centres: Tensor, boxes: Tensor, margin: float = 0.0) -> Tensor:
    """Whether each cell's centre is in each box by `margin` px, [len(boxes), M]."""
    low = centres[None] - boxes[:, None, :2]
    high = boxes[:, None, 2:] - centres[None]
    return torch.cat([low, high], 2).amin(2) > margin


@torch.no_grad()
def assign(scores: Tensor, predicted: Tensor, centres: Tensor, strides: Tensor, boxes: Tensor, kinds: Tensor) -> Targets:
    """Targets of one image from its scores [M, C], predicted boxes [M, 4] px and labels."""
    count = len(centres)
    ignored = inside(centres, boxes[kinds < 0]).any(0) if (kinds < 0).any() else torch.zeros(count, dtype=torch.bool, device=scores.device)
    index = torch.full((count,), -1, dtype=torch.long, device=scores.device)
    quality = torch.zeros(count, device=scores.device)
    real = torch.nonzero(kinds >= 0).flatten()
    if len(real) == 0:
        return Targets(index, quality, ignored)
    wanted = boxes[real]
    side = (wanted[:, 2:] - wanted[:, :2]).amax(1)
    allowed = inside(centres, wanted, 0.5)
    for stride, (least, most) in SIDES_PX.items():
        allowed &= (strides != stride)[None] | ((side >= least) & (side < most))[:, None]
    overlap = pair_iou(wanted, predicted) * allowed
    alignment = scores[:, kinds[real]].T.clamp(min=1e-6) ** SCORE_POWER * (overlap + 1e-4) ** IOU_POWER * allowed
    top, chosen = alignment.topk(min(TOP, count), dim=1)
    positive = torch.zeros_like(allowed).scatter_(1, chosen, top > 0)
    # A cell wanted by several vehicles learns the one it overlaps best.
    best = torch.where(positive, overlap + 1e-4, overlap.new_zeros(())).argmax(0)
    taken = positive.any(0)
    alignment, overlap = alignment * positive, overlap * positive
    relative = alignment / alignment.amax(1, keepdim=True).clamp(min=1e-12) * overlap.amax(1, keepdim=True)
    index[taken] = real[best[taken]]
    quality[taken] = relative[best, torch.arange(count, device=scores.device)][taken]
    return Targets(index, quality, ignored & ~taken)
