"""Paints ground beside the road, and narrows the road: the real images show hardly any lawn or verge, kerb or footpath."""

from dataclasses import dataclass

import cv2
import numpy as np

from motorcade_training.scene import footpath
from motorcade_training.scene.boxes import Boxes
from motorcade_training.scene.ground import Ground
from motorcade_training.scene.texture import SIDE, Bank

#: Road from this probability, nothing of it up to that one.
ROAD, NOT_ROAD = 128, 25
#: Share of images that get some ground painted, of those whose road is made narrower, and of those whose ground lies in the shade of trees.
PAINTED, NARROWED, SHADED = 0.6, 0.6, 0.4
#: Share of narrowed roads beyond whose edge footpaths lie, and of those with the road's own surface in another light there, without a kerb: parking bays.
FOOTPATH, BAY = 0.5, 0.15
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


@dataclass
class Layout:
    """What is painted where, bool [H, W] each."""

    beside: np.ndarray  #: Ground that was no road before.
    cut: np.ndarray  #: What is no road any more.
    kerb: np.ndarray  #: A kerb before grass and gravel.
    paths: list[footpath.Path]


def lay_out(ground: Ground, road: np.ndarray, paved: bool, random: np.random.Generator) -> Layout:
    """Where the road ends from now on; `paved` with footpaths beside it."""
    below = ground.rows > 0
    layout = Layout(below & (road <= NOT_ROAD), np.zeros(road.shape, bool), np.zeros(road.shape, bool), [])
    if random.random() >= NARROWED:
        return layout
    for side in (-1, 1):
        if random.random() < 0.3:
            continue
        # Lateral distance of the road's edge in camera heights; the own lane ends near 1.1.
        edge = random.uniform(1.15, 2.2) if random.random() < 0.5 else random.uniform(1.5, 5)
        beyond = side * ground.across - edge
        if paved:
            on_road = road > NOT_ROAD if random.random() < footpath.OWN else np.ones(road.shape, bool)
            path = footpath.lay(ground, beyond, below & on_road, random)
            layout.paths.append(path)
            layout.cut |= path.where
        else:
            kerb = random.uniform(0.05, 0.25) if random.random() < 0.5 else 0.0
            layout.cut |= below & (beyond > 0)
            layout.kerb |= below & (beyond > 0) & (beyond < kerb)
    return layout


def unhidden(shape: tuple[int, int], boxes: Boxes) -> np.ndarray:
    """Where no vehicle stands, bool [H, W]; the shadow below a vehicle belongs to it."""
    free = np.ones(shape, bool)
    for x1, y1, x2, y2 in boxes:
        low = int(max(y2 + 0.08 * (y2 - y1), 0)) + 1
        free[int(max(y1, 0)) : low, int(max(x1, 0)) : int(max(x2, 0)) + 1] = False
    return free


def cover(ground: Ground, light: float, shade: np.ndarray | None, bank: Bank, random: np.random.Generator) -> np.ndarray:
    """Grass, earth, gravel or paving in perspective, f32 [H, W, 3]."""
    height, width = ground.across.shape
    scale = random.uniform(40, 160)
    u = (ground.across * scale) % SIDE
    v = np.broadcast_to(ground.along * scale * random.uniform(0.3, 1) % SIDE, u.shape)
    texture = cv2.remap(bank.ground(random), u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR, None, cv2.BORDER_WRAP)
    # Far away the texture is finer than a pixel.
    average = texture.mean((0, 1))
    texture = average + (texture - average) * np.clip(4 * ground.rows / height, 0.1, 1)[..., None]
    brightness = light * np.exp(random.uniform(np.log(0.3), np.log(1.3)))
    texture = texture * (brightness * (1 + 0.15 * bank.field(random, height, width)))[..., None]
    if shade is not None:
        texture = texture * shade[..., None]
    if random.random() < DEEP_SHADE:
        dark = random.uniform(*LEFT)
        if random.random() < 0.5:
            # The edge of the shade runs across the ground.
            start = random.uniform(-1, 1) * width + random.uniform(-2, 2) * ground.rows
            columns = ground.across * np.maximum(ground.rows, 1)
            dark = np.where(random.choice([-1, 1]) * (columns - start) > 0, dark, 1.0).astype(np.float32)[..., None]
        texture = texture * dark
    return texture


def paint(image: np.ndarray, road: np.ndarray, boxes: Boxes, vanishing: tuple[float, float], bank: Bank, random: np.random.Generator):
    """A copy of `image` (u8 [H, W, 3]) and `road` (u8 [H, W]) with ground painted. `boxes` [px] stay as they are."""
    height, width = road.shape
    ground = Ground.below(vanishing, height, width)
    kind = random.random()
    layout = lay_out(ground, road, kind < FOOTPATH, random)
    free = unhidden(road.shape, boxes)
    picture = image.astype(np.float32)
    stone = np.median(image[road >= ROAD], 0).astype(np.float32) if (road >= ROAD).any() else np.full(3, 110, np.float32)
    light = float(np.clip(stone.mean() / 110, 0.35, 1.5))
    shade = shadow(bank, random, height, width) if random.random() < SHADED else None
    regions = [layout.beside & side for side in (ground.across < 0, ground.across > 0) if random.random() >= 0.35]
    if FOOTPATH <= kind < FOOTPATH + BAY:
        picture[layout.cut & free] *= np.exp(random.uniform(np.log(0.7), np.log(1.7))) * random.uniform(0.93, 1.07, 3).astype(np.float32)
    elif kind >= FOOTPATH:
        regions.append(layout.cut)
    for region in regions:
        mask = (region & free).astype(np.float32)
        if mask.sum() >= 50:
            alpha = cv2.blur(mask, (3, 3)) * (1.0 if region is layout.cut else random.uniform(0.6, 1.0))
            picture += (cover(ground, light, shade, bank, random) - picture) * alpha[..., None]
    for path in layout.paths:
        footpath.pave(picture, ground, path, free, stone, random)
    kerb = layout.kerb & free
    picture[kerb] = picture[kerb] * 0.2 + 0.8 * light * random.uniform(90, 190)
    return np.clip(picture, 0, 255).astype(np.uint8), np.where((layout.cut | kerb) & free, 0, road)


def shadow(bank: Bank, random: np.random.Generator, height: int, width: int) -> np.ndarray:
    """Light under trees, f32 [height, width]: 1 in the sun, patches of shade with sharp edges."""
    field = bank.field(random, height, width) + 0.5 * bank.field(random, height, width)
    share = 1 / (1 + np.exp(np.clip(-random.uniform(3, 20) * (field - random.uniform(-1.0, 0.8)), -60, 60)))
    return (1 - share * random.uniform(0.4, 0.85)).astype(np.float32)
