"""Rendered vehicles cut out along their outline and parked beside the road of other pictures: real images of motorways hardly show parked rows,
vans at the kerb or vehicles seen from the side."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from motorcade_training.scene.boxes import Boxes
from motorcade_training.scene.label import read_rgb
from motorcade_training.scene.renders import KINDS, extent, read_labels

#: Lower vehicles [px] and those of which less is in sight are not cut out.
LEAST_HEIGHT_PX, LEAST_VISIBLE = 28, 0.7
#: Share of crops that get a row of parked vehicles, and the most vehicles of a row.
SHARE, MOST = 0.35, 5
#: Of a vehicle that is covered by more than this an ignore region remains.
COVERED = 0.7
#: Heights of the camera that is imagined behind a picture [m], and its focal length in widths of a crop.
CAMERA_M, FOCAL = (1.1, 2.0), (0.7, 3.0)


@dataclass(frozen=True)
class Cutout:
    """A vehicle without its surroundings; the picture ends where the vehicle does."""

    image: np.ndarray  #: u8 [h, w, 4], RGB and coverage
    kind: int
    height_m: float


@dataclass
class Scene:
    """A crop on which vehicles are parked."""

    image: np.ndarray  #: u8 [H, W, 3], RGB
    road: np.ndarray  #: u8 [H, W], 255 x probability
    boxes: Boxes  #: [N, 4] px
    kinds: np.ndarray  #: i64 [N], -1 to ignore


def cut_out(drive: Path) -> Iterator[Cutout]:
    """The whole vehicles of a simulated drive that nothing hides."""
    root = drive / "training"
    labels = read_labels(drive)
    for path in sorted((root / "image_02" / "0000").glob("*.png")):
        image, instance = None, None
        for words in labels.get(int(path.stem), []):
            x1, y1, x2, y2 = (float(word) for word in words[6:10])
            if words[2] not in KINDS or float(words[3]) > 0 or int(words[4]) > 0 or y2 - y1 < LEAST_HEIGHT_PX:
                continue
            if image is None:
                image = read_rgb(path)
                instance = cv2.imread(str(root / "instance" / "0000" / path.name), cv2.IMREAD_UNCHANGED)
            mask = instance == int(words[1]) + 1
            seen = extent(mask)
            if seen is None or seen[1] < LEAST_VISIBLE * 0.75 * (x2 - x1) * (y2 - y1):
                continue
            left, top, right, low = seen[0].astype(int)
            part = slice(top, low), slice(left, right)
            cover = np.where(mask[part], 255, 0).astype(np.uint8)[..., None]
            yield Cutout(np.concatenate([image[part], cover], 2), KINDS[words[2]], float(words[10]))


def save(cutouts: list[Cutout], path: Path) -> None:
    """Writes cut-outs as one file."""
    sizes = np.array([c.image.shape[:2] for c in cutouts], np.int32).reshape(-1, 2)
    pixels = np.concatenate([c.image.ravel() for c in cutouts]) if cutouts else np.zeros(0, np.uint8)
    np.savez_compressed(path, sizes=sizes, pixels=pixels, kinds=[c.kind for c in cutouts], heights_m=[c.height_m for c in cutouts])


def load(path: Path) -> list[Cutout]:
    """Reads what `save` wrote."""
    with np.load(path) as stored:
        sizes, pixels, kinds, heights = (stored[name] for name in ("sizes", "pixels", "kinds", "heights_m"))
    ends = np.cumsum(sizes.prod(1) * 4)
    parts = np.split(pixels, ends[:-1])
    return [Cutout(p.reshape(*size, 4), int(k), float(h)) for p, size, k, h in zip(parts, sizes, kinds, heights)]


def park(scene: Scene, vanishing: tuple[float, float], cutouts: list[Cutout], random: np.random.Generator) -> None:
    """Puts a row of vehicles beside the road, far ones first. Those of the picture that are nearer stay in front: there none is put."""
    height, width = scene.image.shape[:2]
    below = height - vanishing[1]
    if below < 12:
        return
    camera_m, focal_px = random.uniform(*CAMERA_M), random.uniform(*FOCAL) * width
    across = random.choice([-1, 1]) * random.uniform(1.3, 6.0)
    # Rows below the horizon of the nearest one; depth in camera heights is focal length over rows.
    nearest = np.exp(random.uniform(np.log(6.0), np.log(0.9 * below)))
    gap = random.uniform(4.5, 9.0) / camera_m
    depths = focal_px / nearest + gap * np.arange(int(random.integers(1, MOST + 1)))
    road = scene.road >= 128
    light = float(np.clip(scene.image[road].mean() / 110, 0.3, 1.3)) if road.any() else 1.0
    light *= random.uniform(0.5, 1.2)
    for depth in depths[::-1]:
        cutout = cutouts[int(random.integers(len(cutouts)))]
        rows = focal_px / depth
        h = cutout.height_m / camera_m * rows
        w = h * cutout.image.shape[1] / cutout.image.shape[0]
        x, y = vanishing[0] + (across + random.normal(0, 0.05)) * rows - w / 2, vanishing[1] + rows - h
        put(scene, cutout, np.array([x, y, x + w, y + h], np.float32), light, random)


def put(scene: Scene, cutout: Cutout, box: np.ndarray, light: float, random: np.random.Generator) -> None:
    """Draws a vehicle with the shadow below it, unless a nearer one stands there."""
    height, width = scene.image.shape[:2]
    x1, y1 = (int(round(float(v))) for v in box[:2])
    w, h = max(int(round(float(box[2] - box[0]))), 1), max(int(round(float(box[3] - box[1]))), 1)
    left, top, right, low = max(x1, 0), max(y1, 0), min(x1 + w, width), min(y1 + h, height)
    if h < 5 or w > 1.5 * width or right - left < 3 or low - top < 3:
        return
    others = scene.boxes
    meets = (others[:, 0] < right) & (others[:, 2] > left) & (others[:, 1] < low) & (others[:, 3] > top)
    if (meets & (others[:, 3] >= box[3] - 1)).any():
        return
    picture = cv2.resize(cutout.image[::, :: random.choice([-1, 1])], (w, h), interpolation=cv2.INTER_AREA if h < cutout.image.shape[0] else cv2.INTER_LINEAR)
    shade = np.ones((height, width), np.float32)
    cv2.ellipse(shade, ((x1 + w / 2, y1 + h - 0.04 * h), (1.05 * w, 0.16 * h + 2), 0), 0.35, -1)
    scene.image[:] = (scene.image * cv2.blur(shade, (3, 3))[..., None]).astype(np.uint8)
    part = picture[top - y1 : low - y1, left - x1 : right - x1].astype(np.float32)
    cover = part[..., 3:] / 255
    under = scene.image[top:low, left:right]
    scene.image[top:low, left:right] = np.clip(under * (1 - cover) + part[..., :3] * light * cover, 0, 255).astype(np.uint8)
    scene.road[top:low, left:right] = (scene.road[top:low, left:right] * (1 - cover[..., 0])).astype(scene.road.dtype)
    for index in np.flatnonzero(meets):
        a, b = np.maximum(others[index, :2], (left, top)).astype(int), np.ceil(np.minimum(others[index, 2:], (right, low))).astype(int)
        hidden = cover[a[1] - top : b[1] - top, a[0] - left : b[0] - left].sum()
        if hidden > COVERED * max(float(np.prod(others[index, 2:] - others[index, :2])), 1.0):
            scene.kinds[index] = -1
    scene.boxes = np.vstack([others, np.array([[left, top, right, low]], np.float32)])
    inside = (right - left) * (low - top) / (w * h)
    scene.kinds = np.append(scene.kinds, cutout.kind if inside >= 0.3 and h >= 7 else -1)
