"""Textures of the ground beside a road, made from noise."""

import cv2
import numpy as np

#: Side of a texture [px]; textures tile.
SIDE = 256


def noise(random: np.random.Generator, octaves: tuple[int, ...], roughness: float) -> np.ndarray:
    """Tiling noise with zero mean and unit deviation, f32 [SIDE, SIDE]; `octaves` are numbers of cells a side."""
    total = np.zeros((SIDE, SIDE), np.float32)
    for level, cells in enumerate(octaves):
        grid = random.standard_normal((cells, cells)).astype(np.float32)
        grid = np.pad(grid, 2, "wrap")
        scale = SIDE // cells
        fine = cv2.resize(grid, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
        total += roughness**level * fine[2 * scale : 2 * scale + SIDE, 2 * scale : 2 * scale + SIDE]
    return (total - total.mean()) / (total.std() + 1e-6)


def hsv(hue_deg: float, saturation: float, value: float) -> np.ndarray:
    """A colour as RGB 0..255."""
    pixel = np.array([[[hue_deg / 2, saturation * 255, value * 255]]], np.uint8)
    return cv2.cvtColor(pixel, cv2.COLOR_HSV2RGB)[0, 0].astype(np.float32)


def ground(random: np.random.Generator) -> np.ndarray:
    """Grass, dry grass, earth, gravel, sand or paving; u8 [SIDE, SIDE, 3], RGB."""
    kind = random.choice(["grass", "grass", "grass", "dry", "earth", "gravel", "paving"])
    fine = noise(random, (8, 32, 128), 1.0)
    coarse = noise(random, (4, 8), 0.7)
    value = random.uniform(0.2, 0.65)
    if kind == "grass":
        colour = hsv(random.uniform(55, 125), random.uniform(0.25, 0.7), value)
    elif kind == "dry":
        colour = hsv(random.uniform(35, 60), random.uniform(0.2, 0.55), value)
    elif kind == "earth":
        colour = hsv(random.uniform(15, 40), random.uniform(0.15, 0.5), value)
    else:
        colour = hsv(random.uniform(20, 60), random.uniform(0.0, 0.15), value + 0.15)
    rough = {"grass": 0.2, "dry": 0.17, "earth": 0.12, "gravel": 0.12, "paving": 0.05}[kind] * random.uniform(0.6, 1.4)
    light = 1 + rough * fine + random.uniform(0.05, 0.2) * coarse
    picture = colour[None, None] * light[..., None]
    if kind in ("grass", "dry"):
        # Patches of another tint.
        other = hsv(random.uniform(35, 110), random.uniform(0.2, 0.6), value * random.uniform(0.7, 1.3))
        share = np.clip(0.5 + 0.6 * noise(random, (4, 16), 0.7), 0, 1)[..., None] * random.uniform(0, 0.8)
        picture = picture * (1 - share) + other * light[..., None] * share
    if kind == "paving":
        step = int(random.choice([16, 32, 64]))
        picture[::step] *= 0.75
        picture[:, ::step] *= 0.75
    return np.clip(picture, 0, 255).astype(np.uint8)


class Bank:
    """Textures and noise fields made once; drawing from it is cheap."""

    def __init__(self, seed: int, size: int = 48):
        random = np.random.default_rng([seed, 77])
        self.grounds = [ground(random) for _ in range(size)]
        self.fields = [noise(random, (4, 8, 16), 0.6) for _ in range(size // 2)]

    def ground(self, random: np.random.Generator) -> np.ndarray:
        """A texture of the ground."""
        return self.grounds[random.integers(len(self.grounds))]

    def field(self, random: np.random.Generator, height: int, width: int) -> np.ndarray:
        """Smooth noise of a size, f32 [height, width], about unit deviation."""
        field = np.roll(self.fields[random.integers(len(self.fields))], int(random.integers(SIDE)), 1)
        part = field[: int(random.integers(64, SIDE)), : int(random.integers(64, SIDE))]
        return cv2.resize(part, (width, height), interpolation=cv2.INTER_LINEAR)
