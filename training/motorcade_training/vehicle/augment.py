"""From stored crops to the network's input, as the product would cut it, with everything varied that may vary."""

import math
from dataclasses import dataclass

import torch
from torch.nn import functional

from motorcade_training.vehicle.data import Batch
from motorcade_training.vehicle.layout import (
    DEVIATION,
    HIDDEN,
    INPUT_PX,
    MARGIN,
    MEAN,
    MIRROR,
    OUTSIDE,
    UNKNOWN,
    VISIBLE,
)


@dataclass
class Sample:
    """Input and targets of the network."""

    #: (N, 4, 64, 64).
    input: torch.Tensor
    #: (N, 36, 2) in the input, 0..1 from edge to edge.
    keypoints: torch.Tensor
    sights: torch.Tensor
    heading_rad: torch.Tensor
    body: torch.Tensor
    dimensions_m: torch.Tensor


@dataclass(frozen=True)
class Strength:
    """How much is varied; chances are per crop."""

    shift: float = 0.06
    scale: float = 0.10
    cut: float = 0.25
    flip: float = 0.5
    erase: float = 0.40
    colour: float = 0.9
    blur: float = 0.35


NONE = Strength(0, 0, 0, 0, 0, 0, 0)


def augment(batch: Batch, strength: Strength, random: torch.Generator) -> Sample:
    """Cuts, varies and normalises a batch, on its device; `random` is of the same device."""
    count, device = batch.crops.shape[0], batch.crops.device

    def uniform(*shape: int) -> torch.Tensor:
        return torch.rand(*shape, generator=random, device=device)

    box, picture = batch.box.clone(), batch.picture.clone()
    cut_border(box, picture, strength.cut, uniform)
    middle, size = 0.5 * (box[:, :2] + box[:, 2:]), box[:, 2:] - box[:, :2]
    middle = middle + strength.shift * (2 * uniform(count, 2) - 1) * size
    size = size * torch.exp(strength.scale * (2 * uniform(count, 2) - 1))
    # The box the network is told of is the varied one; headings are against the ray through its middle.
    column_px = (middle[:, 0] - 0.5 * (batch.box[:, 0] + batch.box[:, 2])) * batch.scale[:, 0]
    heading = batch.heading_rad + column_px / batch.focal_px
    aspect = torch.log(size[:, 0] * batch.scale[:, 0] / (size[:, 1] * batch.scale[:, 1]))

    low, extent = middle - 0.5 * MARGIN * size, MARGIN * size
    flip = uniform(count) < strength.flip
    image = cut(batch.crops, low, extent, flip)
    inside = inside_picture(low, extent, picture, flip)
    keypoints = (batch.keypoints - low[:, None]) / extent[:, None]
    # Pixel centres lie at integers in the stored crop, edges at 0 and 1 here; both from the picture's edges on.
    sights = batch.sights.clone()
    beyond = ((batch.keypoints < picture[:, None, :2]) | (batch.keypoints > picture[:, None, 2:])).any(dim=2)
    sights[beyond & (sights != UNKNOWN)] = OUTSIDE

    keypoints, sights, heading = mirrored(keypoints, sights, heading, flip)
    image = photometric(image, strength, random)
    erase(image, keypoints, sights, strength.erase, uniform)
    image = (image - MEAN) / DEVIATION * inside
    plane = aspect[:, None, None, None].expand(count, 1, INPUT_PX, INPUT_PX)
    return Sample(torch.cat([image, plane], dim=1), keypoints, sights, heading, batch.body, batch.dimensions_m)


def cut_border(box: torch.Tensor, picture: torch.Tensor, chance: float, uniform) -> None:
    """Moves a border of the picture into some boxes, which then end there."""
    count = box.shape[0]
    chosen = uniform(count) < chance
    # Sides more often than top and bottom: left, top, right, bottom.
    side = torch.tensor([0, 2, 0, 2, 3, 1], device=box.device)[(6 * uniform(count)).long().clamp(max=5)]
    share = 0.10 + 0.60 * uniform(count)
    for k in range(4):
        rows = chosen & (side == k)
        low, high = box[:, k % 2], box[:, k % 2 + 2]
        edge = low + share * (high - low) if k < 2 else high - share * (high - low)
        box[rows, k] = edge[rows]
        picture[rows, k] = edge[rows]


def cut(crops: torch.Tensor, low: torch.Tensor, extent: torch.Tensor, flip: torch.Tensor) -> torch.Tensor:
    """(N, 3, 64, 64) in 0..1: the part from `low` on, stretched; coordinates have pixel centres at integers."""
    side = crops.shape[1]
    step = (torch.arange(INPUT_PX, device=low.device) + 0.5) / INPUT_PX
    x = torch.where(flip[:, None], 1 - step[None], step[None])
    x = low[:, :1] + x * extent[:, :1]
    y = low[:, 1:] + step[None] * extent[:, 1:]
    x, y = (2 * x + 1) / side - 1, (2 * y + 1) / side - 1
    grid = torch.stack([x[:, None, :].expand(-1, INPUT_PX, -1), y[:, :, None].expand(-1, -1, INPUT_PX)], dim=3)
    image = crops.permute(0, 3, 1, 2).float() / 255
    return functional.grid_sample(image, grid, mode="bilinear", padding_mode="border", align_corners=False)


def inside_picture(
    low: torch.Tensor, extent: torch.Tensor, picture: torch.Tensor, flip: torch.Tensor
) -> torch.Tensor:
    """(N, 1, 64, 64): 1 where the middle of an input pixel lies in the picture."""
    step = (torch.arange(INPUT_PX, device=low.device) + 0.5) / INPUT_PX
    x = torch.where(flip[:, None], 1 - step[None], step[None])
    x = low[:, :1] + x * extent[:, :1]
    y = low[:, 1:] + step[None] * extent[:, 1:]
    columns = (x >= picture[:, :1]) & (x <= picture[:, 2:3])
    rows = (y >= picture[:, 1:2]) & (y <= picture[:, 3:])
    return (columns[:, None, None, :] & rows[:, None, :, None]).float()


def mirrored(
    keypoints: torch.Tensor, sights: torch.Tensor, heading: torch.Tensor, flip: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Left and right change places where `flip` is true; headings change sign."""
    across = torch.stack([1 - keypoints[..., 0], keypoints[..., 1]], dim=2)[:, MIRROR]
    keypoints = torch.where(flip[:, None, None], across, keypoints)
    sights = torch.where(flip[:, None], sights[:, MIRROR], sights)
    return keypoints, sights, torch.where(flip, -heading, heading)


def photometric(image: torch.Tensor, strength: Strength, random: torch.Generator) -> torch.Tensor:
    """Exposure, gamma, contrast, colour, grey, clipping, blur and noise; values stay in 0..1."""
    count, device = image.shape[0], image.device

    def uniform(low: float, high: float) -> torch.Tensor:
        return low + (high - low) * torch.rand(count, 1, 1, 1, generator=random, device=device)

    def chosen(chance: float) -> torch.Tensor:
        return torch.rand(count, 1, 1, 1, generator=random, device=device) < chance

    if strength.colour > 0:
        gain = torch.exp(uniform(-0.45, 0.45)) * (1 + 0.12 * (torch.rand(count, 3, 1, 1, generator=random, device=device) - 0.5))
        varied = (image * gain).clamp(1e-4, 4.0) ** torch.exp(uniform(-0.35, 0.35))
        mean = varied.mean(dim=(1, 2, 3), keepdim=True)
        varied = (varied - mean) * torch.exp(uniform(-0.35, 0.45)) + mean + uniform(-0.08, 0.08)
        grey = varied.mean(dim=1, keepdim=True)
        saturation = torch.where(chosen(0.2), 0.0, uniform(0.4, 1.5))
        varied = (grey + saturation * (varied - grey)).clamp(0, 1)
        image = torch.where(chosen(strength.colour), varied, image)
    if strength.blur > 0:
        rows = chosen(strength.blur).flatten()
        if rows.any():
            sigma = 0.4 + 1.2 * float(torch.rand(1, generator=random, device=device))
            image[rows] = blurred(image[rows], sigma)
        noise = torch.randn(image.shape, generator=random, device=device) * uniform(0, 0.03)
        image = torch.where(chosen(0.5), (image + noise).clamp(0, 1), image)
    return image


def blurred(image: torch.Tensor, sigma: float) -> torch.Tensor:
    """Gaussian blur."""
    reach = math.ceil(2 * sigma)
    taps = torch.exp(-0.5 * (torch.arange(-reach, reach + 1, device=image.device) / sigma) ** 2)
    taps = (taps / taps.sum()).to(image.dtype)
    flat = image.reshape(-1, 1, *image.shape[2:])
    flat = functional.pad(flat, (reach,) * 4, mode="replicate")
    flat = functional.conv2d(functional.conv2d(flat, taps.view(1, 1, 1, -1)), taps.view(1, 1, -1, 1))
    return flat.reshape(image.shape)


def erase(image: torch.Tensor, keypoints: torch.Tensor, sights: torch.Tensor, chance: float, uniform) -> None:
    """Paints posts and blocks over some crops; keypoints behind them are hidden."""
    count = image.shape[0]
    for i, (lot, kind, x, y, w, h, tone, source) in enumerate(uniform(count, 8).tolist()):
        if lot >= chance:
            continue
        if kind < 0.4:
            # A post from top to bottom.
            width, y0, y1 = 0.02 + 0.10 * w, 0.0, 1.0 if h > 0.2 else 0.8
            x0, x1 = x - 0.5 * width, x + 0.5 * width
        else:
            x0, x1 = x - 0.5 * (0.1 + 0.45 * w), x + 0.5 * (0.1 + 0.45 * w)
            # Most things that hide vehicles stand on the ground.
            y0, y1 = (1.0 - (0.15 + 0.5 * h), 1.0) if kind < 0.75 else (y - 0.2 * h - 0.05, y + 0.2 * h + 0.05)
        a, b = (max(0, int(v * INPUT_PX)) for v in (x0, y0))
        c, d = (min(INPUT_PX, math.ceil(v * INPUT_PX)) for v in (x1, y1))
        if c <= a or d <= b:
            continue
        if source < 0.5:
            image[i, :, b:d, a:c] = tone
        else:
            # A piece of another crop.
            image[i, :, b:d, a:c] = image[(i + 1) % count, :, b:d, a:c].clone()
        x, y = keypoints[i].unbind(dim=1)
        covered = (x > x0) & (x < x1) & (y > y0) & (y < y1)
        sights[i, covered & (sights[i] == VISIBLE)] = HIDDEN
