"""A source of labelled pictures on disk: frames.npy, road.npy, boxes.npz."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from motorcade_training.scene.boxes import Boxes
from motorcade_training.scene.classes import BUS, TRUCK
from motorcade_training.scene.fuse import write_boxes
from motorcade_training.scene.renders import Render

#: Neighbouring numbers can show one place: of every BLOCKS blocks of this many frames, one is for validation.
BLOCK, BLOCKS = 100, 12


@dataclass(frozen=True)
class Sample:
    """One labelled picture."""

    image: np.ndarray  #: u8 [H, W, 3], RGB
    road: np.ndarray  #: u8 [H/2, W/2], 255 x probability of road
    boxes: Boxes  #: [N, 4] px of `image`
    kinds: np.ndarray  #: i64 [N], -1 to ignore


class Source:
    """Pictures of one folder, for training or for validation."""

    def __init__(self, folder: Path, part: str):
        """`part`: `train`, `validate` or `all`."""
        self.frames = np.load(folder / "frames.npy", mmap_mode="r")
        self.roads = np.load(folder / "road.npy", mmap_mode="r")
        with np.load(folder / "boxes.npz") as stored:
            frame, boxes, kind = stored["frame"], stored["boxes"], stored["kind"]
        ends = np.searchsorted(frame, np.arange(len(self.frames) + 1))
        self.boxes = [boxes[a:b] for a, b in zip(ends, ends[1:])]
        self.kinds = [kind[a:b] for a, b in zip(ends, ends[1:])]
        held = (np.arange(len(self.frames)) // BLOCK) % BLOCKS == BLOCKS - 1
        chosen = {"train": ~held, "validate": held, "all": held | True}[part]
        self.indices = np.flatnonzero(chosen)
        large = [np.isin(self.kinds[i], (TRUCK, BUS)).any() for i in self.indices]
        #: Pictures with a truck or bus are drawn three times as often.
        self.weights = np.where(large, 3.0, 1.0) / np.where(large, 3.0, 1.0).sum() if len(large) else np.zeros(0)

    def __len__(self) -> int:
        return len(self.indices)

    def draw(self, random: np.random.Generator) -> Sample:
        """A picture at random."""
        return self.sample(int(random.choice(len(self.indices), p=self.weights)))

    def sample(self, number: int) -> Sample:
        """Picture `number` of this part."""
        index = self.indices[number]
        return Sample(self.frames[index], self.roads[index], self.boxes[index], self.kinds[index])


def collect_renders(renders: Iterable[Render], folder: Path, width: int = 1242) -> None:
    """Writes the pictures of simulated drives as a source, all scaled to `width`."""
    folder.mkdir(parents=True, exist_ok=True)
    frames, roads, parts = [], [], []
    for render in renders:
        scale = width / render.image.shape[1]
        height = frames[0].shape[0] if frames else round(render.image.shape[0] * scale) // 2 * 2
        image = cv2.resize(render.image, (width, round(render.image.shape[0] * scale)))
        road = cv2.resize(render.road, (width // 2, round(render.image.shape[0] * scale / 2)), interpolation=cv2.INTER_AREA)
        parts.append((np.full(len(render.kinds), len(frames), np.int32), render.boxes * scale, render.kinds))
        frames.append(fit(image, height))
        roads.append(fit(road, height // 2))
    np.save(folder / "frames.npy", np.stack(frames))
    np.save(folder / "road.npy", np.stack(roads))
    write_boxes(folder, *(np.concatenate(column) for column in zip(*parts)))


def fit(image: np.ndarray, height: int) -> np.ndarray:
    """Cuts off rows at the bottom or repeats the last one."""
    missing = height - image.shape[0]
    return image[:height] if missing <= 0 else np.pad(image, [(0, missing)] + [(0, 0)] * (image.ndim - 1), "edge")
