"""Paints ground beside the road, and narrows the road: the real images show hardly any lawn or verge, kerb or footpath."""

import cv2
import numpy as np

from motorcade_training.scene.boxes import Boxes
from motorcade_training.scene.texture import SIDE, Bank

#: Road from this probability, nothing of it up to that one.
ROAD, NOT_ROAD = 128, 25
#: Share of images that get some ground painted, of those whose road is made narrower, and of those whose ground lies in the shade of trees.
PAINTED, NARROWED, SHADED = 0.6, 0.6, 0.4
#: Share of narrowed roads beyond whose edge the road's own surface goes on in another light: footpaths, parking bays.
FOOTPATH = 0.3
#: Share of painted grounds that lie in deep shade, of houses and dense trees, where a camera shows little but darkness; and how much light is left.
DEEP_SHADE, LEFT = 0.25, (0.08, 0.35)


def vanishing_point(road: np.ndarray) -> tuple[float, float] | None:
    """Where the road ends above, x and y [px of `road`]; none without much road."""
    rows = np.flatnonzero((road >= ROAD).sum(1) > 2)
    if len(rows) < road.shape[0] // 10:
        return None
    top = rows[: max(2, len(rows) // 12)]
    columns = [np.flatnonzero(road[row] >= ROAD).mean() for row in top]
    return float(np.median(columns)), float(rows[0]) - 1.0


def paint(image: np.ndarray, road: np.ndarray, boxes: Boxes, vanishing: tuple[float, float], bank: Bank, random: np.random.Generator):
    """A copy of `image` (u8 [H, W, 3]) and `road` (u8 [H, W]) with ground painted. `boxes` [px] stay as they are."""
    height, width = road.shape
    x = np.arange(width, dtype=np.float32)[None] - vanishing[0]
    y = np.arange(height, dtype=np.float32)[:, None] - vanishing[1]
    below = y > 1.5
    depth = 1 / np.maximum(y, 1.5)
    across = x * depth
    beside = below & (road <= NOT_ROAD)
    cut = np.zeros_like(beside)
    kerb = np.zeros_like(beside)
    if random.random() < NARROWED:
        for side in (-1, 1):
            if random.random() < 0.3:
                continue
            # Lateral distance of the road's edge in camera heights; the own lane ends near 1.1.
            edge = random.uniform(1.15, 2.2) if random.random() < 0.5 else random.uniform(1.5, 5)
            curb = random.uniform(0.05, 0.25) if random.random() < 0.5 else 0.0
            cut |= below & (side * across > edge)
            kerb |= below & (side * across > edge) & (side * across < edge + curb)
    free = np.ones_like(beside)
    for x1, y1, x2, y2 in boxes:
        # The shadow below a vehicle stays.
        low = int(max(y2 + 0.08 * (y2 - y1), 0)) + 1
        free[int(max(y1, 0)) : low, int(max(x1, 0)) : int(max(x2, 0)) + 1] = False
    picture = image.astype(np.float32)
    light = float(np.clip(image[road >= ROAD].mean() / 110, 0.35, 1.5)) if (road >= ROAD).any() else 1.0
    shade = shadow(bank, random, height, width) if random.random() < SHADED else None
    regions = [beside & (across < 0), beside & (across > 0), cut]
    for region in regions:
        if random.random() < 0.35 and region is not cut:
            continue
        if region is cut and random.random() < FOOTPATH:
            picture[cut & free] *= np.exp(random.uniform(np.log(0.7), np.log(1.7))) * random.uniform(0.93, 1.07, 3).astype(np.float32)
            continue
        mask = (region & free).astype(np.float32)
        if mask.sum() < 50:
            continue
        scale = random.uniform(40, 160)
        u = (across * scale) % SIDE
        v = np.broadcast_to(depth * height * scale * random.uniform(0.3, 1) % SIDE, u.shape)
        texture = cv2.remap(bank.ground(random), u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR, None, cv2.BORDER_WRAP)
        # Far away the texture is finer than a pixel.
        average = texture.mean((0, 1))
        texture = average + (texture - average) * np.clip(4 * y / height, 0.1, 1)[..., None]
        brightness = light * np.exp(random.uniform(np.log(0.3), np.log(1.3)))
        texture = texture * (brightness * (1 + 0.15 * bank.field(random, height, width)))[..., None]
        if shade is not None:
            texture = texture * shade[..., None]
        if random.random() < DEEP_SHADE:
            dark = random.uniform(*LEFT)
            if random.random() < 0.5:
                # The edge of the shade runs across the ground.
                start = random.uniform(-1, 1) * width + random.uniform(-2, 2) * y
                dark = np.where(random.choice([-1, 1]) * (x - start) > 0, dark, 1.0).astype(np.float32)[..., None]
            texture = texture * dark
        alpha = cv2.blur(mask, (3, 3)) * np.where(region is cut, 1.0, random.uniform(0.6, 1.0))
        picture += (texture - picture) * alpha[..., None]
    kerb &= free
    picture[kerb] = picture[kerb] * 0.2 + 0.8 * light * random.uniform(90, 190)
    return np.clip(picture, 0, 255).astype(np.uint8), np.where((cut | kerb) & free, 0, road)


def shadow(bank: Bank, random: np.random.Generator, height: int, width: int) -> np.ndarray:
    """Light under trees, f32 [height, width]: 1 in the sun, patches of shade with sharp edges."""
    field = bank.field(random, height, width) + 0.5 * bank.field(random, height, width)
    share = 1 / (1 + np.exp(np.clip(-random.uniform(3, 20) * (field - random.uniform(-1.0, 0.8)), -60, 60)))
    return (1 - share * random.uniform(0.4, 0.85)).astype(np.float32)
