"""Training crops: a window of a picture at some zoom, with ground painted beside the road, occluders and other light."""

from dataclasses import dataclass

import cv2
import numpy as np

from motorcade_training.scene import clutter, cutout, verge
from motorcade_training.scene.boxes import area
from motorcade_training.scene.classes import BUS, TRUCK
from motorcade_training.scene.photometry import distort
from motorcade_training.scene.source import Sample
from motorcade_training.scene.texture import Bank

#: Road targets are made at this stride [px].
ROAD_STRIDE = 4


@dataclass(frozen=True)
class CropOptions:
    """Settings of the crops."""

    #: Heights and widths of crops [px]; batches take turns. The large ones hold near vehicles whole.
    sizes: tuple[tuple[int, int], ...] = ((192, 352), (192, 352), (256, 480))
    #: Share of crops aimed at a vehicle.
    aimed: float = 0.55
    #: Least height that an aimed vehicle gets [px], and the most as a share of the crop's height; drawn evenly in the logarithm.
    heights: tuple[float, float] = (12.0, 0.9)
    #: Limits of the zoom.
    zooms: tuple[float, float] = (0.45, 2.6)
    #: Lower or narrower boxes are regions to ignore [px].
    least_side: float = 7.0
    #: A vehicle of which less is in the crop is a region to ignore.
    least_inside: float = 0.3


@dataclass(frozen=True)
class Crop:
    """A training crop."""

    image: np.ndarray  #: u8 [H, W, 3], RGB
    boxes: np.ndarray  #: f32 [N, 4] px
    kinds: np.ndarray  #: i64 [N], -1 to ignore
    road: np.ndarray  #: f32 [H/4, W/4], probability; -1 unknown


def window(sample: Sample, size: tuple[int, int], options: CropOptions, random: np.random.Generator) -> np.ndarray:
    """Affine map crop_from_image, f64 [2, 3], of positions: the pixel with index i covers [i, i + 1), as boxes have it."""
    height, width = size
    source_height, source_width = sample.image.shape[:2]
    real = np.flatnonzero((sample.kinds >= 0) & (sample.boxes[:, 3] - sample.boxes[:, 1] > 9))
    if len(real) and random.random() < options.aimed:
        weights = np.where(np.isin(sample.kinds[real], (TRUCK, BUS)), 3.0, 1.0)
        box = sample.boxes[real[random.choice(len(real), p=weights / weights.sum())]]
        wanted = np.exp(random.uniform(np.log(options.heights[0]), np.log(options.heights[1] * height)))
        zoom = np.clip(wanted / (box[3] - box[1]), *options.zooms)
        target = np.array([random.uniform(0, width), random.uniform(0.25, 0.85) * height])
        centre = (box[:2] + box[2:]) / 2
    else:
        zoom = np.exp(random.uniform(np.log(0.5), np.log(1.25)))
        target = np.array([width, height]) / 2
        centre = np.array([random.uniform(0, source_width), random.uniform(0.3, 0.75) * source_height])
    stretch = np.exp(random.normal(0, 0.06))
    scale = np.array([zoom * stretch, zoom / stretch])
    mirror = random.random() < 0.5
    shift = target - scale * centre
    # Keep the window inside the picture where it fits.
    free = np.array([width, height]) - scale * np.array([source_width, source_height])
    shift = np.clip(shift, np.minimum(free, 0), np.maximum(free, 0))
    matrix = np.array([[scale[0], 0, shift[0]], [0, scale[1], shift[1]]])
    angle = np.deg2rad(random.normal(0, 1.5))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    middle = np.array([width, height]) / 2
    matrix = np.column_stack([turn @ matrix[:, :2], turn @ (matrix[:, 2] - middle) + middle])
    if mirror:
        matrix = np.array([[-1.0, 0, width], [0, 1.0, 0]]) @ np.vstack([matrix, [0, 0, 1]])
    return matrix


def of_indices(matrix: np.ndarray, middle: float = 0.5) -> np.ndarray:
    """The map of pixel indices, as `cv2.warpAffine` takes it, of a map of positions; `middle` is the position of the middle of pixel 0."""
    return np.column_stack([matrix[:, :2], matrix[:, 2] + middle * matrix[:, :2].sum(1) - 0.5])


def move(boxes: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Boxes under an affine map. Rotations are small: edges are moved through their middles."""
    middle_x, middle_y = (boxes[:, 0] + boxes[:, 2]) / 2, (boxes[:, 1] + boxes[:, 3]) / 2
    x = np.stack([matrix[0, 0] * boxes[:, k] + matrix[0, 1] * middle_y + matrix[0, 2] for k in (0, 2)], 1)
    y = np.stack([matrix[1, 0] * middle_x + matrix[1, 1] * boxes[:, k] + matrix[1, 2] for k in (1, 3)], 1)
    return np.stack([x.min(1), y.min(1), x.max(1), y.max(1)], 1).astype(np.float32)


def crop(
    sample: Sample, size: tuple[int, int], options: CropOptions, bank: Bank, cutouts: list[cutout.Cutout], random: np.random.Generator
) -> Crop:
    """A crop of `size` (height, width) at random. `cutouts`: vehicles to park beside the road, none for none."""
    height, width = size
    matrix = window(sample, size, options, random)
    smaller = abs(matrix[1, 1]) < 0.75
    # A pixel of the blurred picture is the mean of pixels i - 1 and i: its middle is between them, at the position i.
    image, middle = (cv2.blur(sample.image, (2, 2)), 0.0) if smaller else (np.ascontiguousarray(sample.image), 0.5)
    image = cv2.warpAffine(image, of_indices(matrix, middle), (width, height), flags=cv2.INTER_LINEAR, borderValue=(114, 114, 114))
    # The road is stored at half the size.
    half = of_indices(np.column_stack([2 * matrix[:, :2], matrix[:, 2]]))
    road = cv2.warpAffine(np.ascontiguousarray(sample.road), half, (width, height), flags=cv2.INTER_LINEAR)
    known = cv2.warpAffine(np.ones(sample.road.shape, np.uint8), half, (width, height), flags=cv2.INTER_NEAREST)
    moved = move(sample.boxes, matrix)
    boxes = np.clip(moved, 0, np.array([width, height] * 2)).astype(np.float32)
    inside = area(boxes) / np.maximum(area(moved), 1e-6)
    sides = np.minimum(boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1])
    keep = (inside > 0.03) & (sides > 1)
    good = (inside >= options.least_inside) & (sides >= options.least_side)
    kinds = np.where(good, sample.kinds, -1)[keep]
    boxes = boxes[keep]
    vanishing = verge.vanishing_point(sample.road)
    if vanishing is not None:
        place = half @ np.array([*vanishing, 1.0])
        if random.random() < verge.PAINTED:
            image, road = verge.paint(image, road, boxes, (place[0], place[1]), bank, random)
        if cutouts and random.random() < cutout.SHARE:
            scene = cutout.Scene(image.copy(), road.copy(), boxes, kinds)
            cutout.park(scene, (place[0], place[1]), cutouts, random)
            image, road, boxes, kinds = scene.image, scene.road, scene.boxes, scene.kinds
    image, road = clutter.scatter(image, boxes, road, bank, random)
    image = occlude(image, random)
    target = cv2.resize(road, (width // ROAD_STRIDE, height // ROAD_STRIDE), interpolation=cv2.INTER_AREA) / np.float32(255)
    certain = cv2.resize(known, (width // ROAD_STRIDE, height // ROAD_STRIDE), interpolation=cv2.INTER_NEAREST)
    target = np.where(certain > 0, target, -1).astype(np.float32)
    return Crop(distort(image, bank, random), boxes, kinds, target)


def occlude(image: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Poles and trunks in front of everything."""
    height, width = image.shape[:2]
    if random.random() >= 0.2:
        return image
    image = image.copy()
    for _ in range(random.integers(1, 4)):
        thick = int(np.exp(random.uniform(np.log(2), np.log(14))))
        x = int(random.uniform(0, width - thick))
        top, low = (0 if random.random() < 0.7 else int(random.uniform(0, 0.5 * height))), int(random.uniform(0.5, 1.0) * height)
        round_light = np.sin(np.linspace(0.3, 2.8, thick))[None, :, None]
        image[top:low, x : x + thick] = np.clip(random.uniform(20, 200, 3) * round_light * random.uniform(0.6, 1.1), 0, 255)
    return image
