"""What the scene network takes for vehicles in its own training crops, and what each is.

candidates.npz  crops f16 [N, 4, 64, 64] (inputs of the vehicle network), present u8 [N], score f32 [N]
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from motorcade_training.scene import cutout
from motorcade_training.scene.augment import CropOptions
from motorcade_training.scene.boxes import Boxes, area, intersection, iou
from motorcade_training.scene.dataset import CropStream
from motorcade_training.scene.runner import SceneRunner
from motorcade_training.scene.source import Source
from motorcade_training.vehicle.crop import cut

#: Boxes of the network below this score are not looked at.
LEAST_SCORE = 0.1
#: Lower boxes tell too little [px].
LEAST_HEIGHT = 12.0
#: Overlap with a labelled vehicle from which a box shows it.
PRESENT_IOU = 0.5
#: Overlap with every label, and share of the box within one, below which it shows none. Those between are left out.
ABSENT_IOU, ABSENT_INSIDE = 0.15, 0.3


@dataclass(frozen=True)
class Candidates:
    """Boxes of the scene network."""

    crops: np.ndarray  #: f16 [N, 4, 64, 64]
    present: np.ndarray  #: u8 [N]
    score: np.ndarray  #: f32 [N]

    @classmethod
    def load(cls, paths: list[Path]) -> "Candidates":
        """All of several files, in their order."""
        files = [np.load(path) for path in paths]
        return cls(*(np.concatenate([file[name] for file in files]) for name in ("crops", "present", "score")))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of `make-data presence`."""
    parser.add_argument("--data", type=Path, default=Path("work/scene/data"), help="data of the scene network")
    parser.add_argument("--network", type=Path, default=Path("../models/scene.onnx"), help="the scene network")
    parser.add_argument("--count", type=int, default=8000, help="training crops to look at")
    parser.add_argument("--renders", type=float, default=0.25, help="share of rendered crops")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("work/presence/candidates.npz"))


def run(options: argparse.Namespace) -> None:
    """Writes the candidates."""
    sources = [(Source(options.data / "real", "train"), 1 - options.renders), (Source(options.data / "renders", "all"), options.renders)]
    cutouts = cutout.load(options.data / "cutouts.npz")
    stream = CropStream(sources, CropOptions(), 1, options.seed, options.count, cutouts=cutouts)
    runners = {size: SceneRunner(options.network, *size) for size in set(CropOptions().sizes)}
    found: list[tuple[np.ndarray, int, float]] = []
    for number in range(options.count):
        crop = stream.crop(number, stream.size(number))
        image = np.ascontiguousarray(crop.image)
        boxes, scores, _, _ = runners[image.shape[:2]](image, LEAST_SCORE)
        for box, score in zip(boxes, scores):
            present = presence(box, crop.boxes, crop.kinds)
            if present is not None and box[3] - box[1] >= LEAST_HEIGHT:
                found.append((cut(image, tuple(box))[0].astype(np.float16), present, score))
        if (number + 1) % 500 == 0:
            print(f"{number + 1}/{options.count} crops, {len(found)} boxes", flush=True)
    crops, present, score = (np.array(column) for column in zip(*found))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    np.savez(options.out, crops=crops, present=present.astype(np.uint8), score=score.astype(np.float32))


def presence(box: np.ndarray, labels: Boxes, kinds: np.ndarray) -> int | None:
    """1 for a box that shows a labelled vehicle, 0 for one that shows none, `None` where that is doubtful."""
    if not len(labels):
        return 0
    overlaps = iou(box[None], labels)[0]
    best = int(overlaps.argmax())
    if overlaps[best] > PRESENT_IOU and kinds[best] >= 0:
        return 1
    inside = intersection(box[None], labels)[0] / max(float(area(box[None])[0]), 1e-6)
    return 0 if overlaps.max() < ABSENT_IOU and inside.max() < ABSENT_INSIDE else None
