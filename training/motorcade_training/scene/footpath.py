"""Footpaths behind kerbs: the real images hardly have any, and where their stone is the road's own, only the kerb tells them from it."""

from dataclasses import dataclass

import cv2
import numpy as np

from motorcade_training.scene.ground import Ground

#: Share of sides with a side street, whose corners are round.
JUNCTION = 0.4
#: Share of footpaths that cover road alone, and not what stands beside it too; and of those with the joints of slabs.
OWN, SLABS = 0.75, 0.5
#: Across from here on is no footpath: the mouth of a side street.
OPEN = 100.0


@dataclass
class Path:
    """A footpath."""

    where: np.ndarray  #: Its pixels, bool [H, W].
    beyond: np.ndarray  #: How far a place lies beyond the edge of the road, in heights of the camera, f32 [H, W].


def corner(along: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """How far a road's edge recedes at each place: nothing, or around the corners of a side street."""
    if random.random() >= JUNCTION:
        return np.zeros_like(along)
    start = np.exp(random.uniform(np.log(0.7), np.log(6)))
    length = start * random.uniform(0.3, 2.5)
    long, wide = length * random.uniform(0.1, 0.45), random.uniform(0.7, 3)
    inside = np.clip(np.minimum(along - start, start + length - along) / long, 0, 1)
    return np.where(inside >= 1, OPEN, wide * (1 - np.sqrt(1 - inside**2))).astype(np.float32)


def joints(ground: Ground, random: np.random.Generator) -> np.ndarray:
    """Light of slabs, f32 [H, W]: 1, other in their joints, fading where they are finer than pixels."""
    wide, long = random.uniform(0.15, 0.7), random.uniform(0.03, 0.35)
    row = np.floor(ground.along / long)
    # Every second row is shifted, in some patterns.
    shift = row % 2 * 0.5 if random.random() < 0.5 else 0.0
    line = random.uniform(0.03, 0.1)
    lines = ((ground.across / wide + shift) % 1 < line) | (ground.along / long % 1 < line)
    shows = np.clip(wide * ground.rows / 12, 0, 1)
    return 1 + (random.uniform(0.6, 1.15) - 1) * lines * shows


def lay(ground: Ground, beyond: np.ndarray, where: np.ndarray, random: np.random.Generator) -> Path:
    """A footpath beyond an edge of the road (`beyond` > 0, heights of the camera, f32 [H, W]), within `where` (bool [H, W])."""
    beyond = beyond - corner(ground.along, random)
    # Ends in another road, or goes on as far as the picture.
    wide = random.uniform(0.5, 2.0) if random.random() < 0.4 else np.inf
    return Path(where & (beyond > 0) & (beyond < wide), beyond)


def pave(picture: np.ndarray, ground: Ground, path: Path, free: np.ndarray, stone: np.ndarray, random: np.random.Generator) -> None:
    """Paints a footpath with its kerb into `picture` (f32 [H, W, 3]), where nothing hides it (`free`, bool [H, W]). `stone`: colour of the road, f32 [3]."""
    inside, beyond = path.where & free, path.beyond
    if not inside.any():
        return
    before = picture.copy()
    # Lane markings of what was a lane go.
    surface = np.minimum(picture[inside], 1.15 * stone)
    if random.random() < 0.4:
        surface = 0.3 * surface + 0.7 * stone
    # A footpath as bright as the road is told by its kerb alone.
    light = np.exp(random.normal(0, 0.3))
    light = light * (joints(ground, random)[inside] if random.random() < SLABS else np.ones(int(inside.sum())))
    picture[inside] = surface * light[:, None] * random.uniform(0.93, 1.07, 3).astype(np.float32)
    # A step up has a face that is seen from the road; a flat kerb has its top alone.
    top = random.uniform(0.04, 0.14)
    strip = inside & (beyond < top)
    joint = np.broadcast_to(1 - 0.3 * (ground.along / random.uniform(0.1, 0.6) % 1 < 0.06), free.shape)[strip]
    picture[strip] = 0.15 * picture[strip] + 0.85 * stone * np.exp(random.uniform(-0.5, 0.8)) * joint[:, None]
    if random.random() < 0.6:
        face = free & (ground.rows > 0) & (beyond > -random.uniform(0.02, 0.08)) & (beyond <= 0)
        picture[face] *= random.uniform(0.35, 0.85)
    if random.random() < 0.35:
        gutter = free & (ground.rows > 0) & (beyond > -random.uniform(0.1, 0.25)) & (beyond <= 0)
        picture[gutter] *= random.uniform(0.75, 1.2)
    soften(picture, (picture != before).any(2))


def soften(picture: np.ndarray, changed: np.ndarray) -> None:
    """Blurs the edges of what was painted into `picture` as a lens does; `changed` bool [H, W]."""
    rim = cv2.morphologyEx(changed.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > 0
    picture[rim] = cv2.GaussianBlur(picture, (3, 3), 0.6)[rim]
