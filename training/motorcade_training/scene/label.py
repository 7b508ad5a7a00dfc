"""Teacher labels of a folder of images: `frames.npy`, `road.npy` and `teacher.npz`.

frames.npy  u8 [N, H, W, 3]      the images, RGB, decoded once so that training does not have to
road.npy    u8 [N, H/2, W/2]     255 x probability of road
teacher.npz frame i32 [M], boxes f32 [M, 4] px, score f32 [M], kind i64 [M] (class), names [N], rows i64 [2] searched for boxes
"""

import time
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np

from motorcade_training.scene.teacher import BoxTeacher, RoadTeacher


@dataclass(frozen=True)
class TeacherOptions:
    """Settings of the teachers."""

    #: Rows of the image searched for vehicles, first and one after the last [px].
    rows: tuple[int, int]
    #: YOLOX sees the image at this multiple of its size; small vehicles need more than 1.
    scale: float = 1.5
    #: Input height and width of the road network [px].
    road_size: tuple[int, int] = (256, 512)
    #: Also look at the mirror image and take the mean; doubles the time.
    mirror: bool = True


class _Worker:
    """Labels single images and writes pixels and road to the arrays on disk."""

    current: "_Worker"

    def __init__(self, out: Path, models: Path, width: int, options: TeacherOptions):
        cv2.setNumThreads(1)
        self.frames = np.load(out / "frames.npy", mmap_mode="r+")
        self.roads = np.load(out / "road.npy", mmap_mode="r+")
        self.boxes_of = BoxTeacher(models, width, options.rows, options.scale, options.mirror)
        self.road_of = RoadTeacher(models, options.road_size, options.mirror)

    def label(self, index: int, path: Path):
        image = read_rgb(path)
        if image.shape != self.frames.shape[1:]:
            raise ValueError(f"{path} is {image.shape[1]}x{image.shape[0]}, others differ: sort images by size")
        self.frames[index] = image
        height, width = self.roads.shape[1:]
        road = cv2.resize(self.road_of(image), (width, height), interpolation=cv2.INTER_AREA)
        self.roads[index] = np.rint(np.clip(road, 0, 1) * 255)
        boxes, scores, classes = self.boxes_of(image)
        return np.full(len(scores), index, np.int32), boxes, scores, classes


def _start(*arguments) -> None:
    _Worker.current = _Worker(*arguments)


def _label(job: tuple[int, Path]):
    return _Worker.current.label(*job)


def label_images(images: list[Path], models: Path, out: Path, options: TeacherOptions, workers: int = 1) -> None:
    """Labels `images` (all of one size, sides multiples of 2) with the networks in `models`."""
    out.mkdir(parents=True, exist_ok=True)
    height, width = read_rgb(images[0]).shape[:2]
    shape = (len(images), height, width, 3)
    np.lib.format.open_memmap(out / "frames.npy", "w+", np.uint8, shape)
    np.lib.format.open_memmap(out / "road.npy", "w+", np.uint8, (len(images), height // 2, width // 2))
    rows: list[tuple[np.ndarray, ...]] = []
    start = time.monotonic()
    with get_context("spawn").Pool(workers, _start, (out, models, width, options)) as pool:
        for row in pool.imap(_label, enumerate(images), chunksize=4):
            rows.append(row)
            if len(rows) % 100 == 0 or len(rows) == len(images):
                print(f"{len(rows)}/{len(images)} images, {len(rows) / (time.monotonic() - start):.1f}/s", flush=True)
    frame, boxes, score, kind = (np.concatenate(column) for column in zip(*rows))
    names = np.array([path.name for path in images])
    searched = np.array(options.rows)
    np.savez(out / "teacher.npz", frame=frame, boxes=boxes, score=score, kind=kind, names=names, rows=searched)


def read_rgb(path: Path) -> np.ndarray:
    """An image as u8 [H, W, 3], RGB."""
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is None:
        raise ValueError(f"{path} does not read as an image")
    return cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
