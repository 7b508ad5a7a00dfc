"""Labels of a set and boxes of the teacher made into one: `boxes.npz` of a source.

boxes.npz  frame i32 [M], boxes f32 [M, 4] px, kind i64 [M]: a class, or -1 for regions to ignore
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from motorcade_training.scene.boxes import Boxes, iou
from motorcade_training.scene.classes import CAR

IGNORE = -1


@dataclass(frozen=True)
class FuseOptions:
    """Thresholds."""

    #: A teacher's box and a label are the same vehicle from this IoU.
    same: float = 0.45
    #: The teacher's box beside a label counts from this score.
    beside_label: float = 0.15
    #: Without a label: a vehicle from this score ...
    sure: float = 0.5
    #: ... and a region to ignore from this one.
    doubtful: float = 0.15
    #: Boxes as large as this [px] must be surer to be ignored: the teacher doubts shadows, trees and houses, which are background.
    large_px: float = 64.0
    doubtful_large: float = 0.35
    #: Lower boxes are regions to ignore [px].
    least_height: float = 8.0
    #: A label without a teacher's box that is lower than this is a region to ignore [px].
    least_height_alone: float = 13.0


def read_labels(path: Path, names: list[str]) -> list[Boxes]:
    """Boxes by image of a CSV `file,x1_px,y1_px,x2_px,y2_px`."""
    index = {name: i for i, name in enumerate(names)}
    boxes: list[list[list[float]]] = [[] for _ in names]
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            if row["file"] in index:
                boxes[index[row["file"]]].append([float(row[k]) for k in ("x1_px", "y1_px", "x2_px", "y2_px")])
    return [np.array(b, np.float32).reshape(-1, 4) for b in boxes]


def fuse(labels: Boxes, boxes: Boxes, scores: np.ndarray, kinds: np.ndarray, rows: tuple[int, int], options: FuseOptions):
    """Vehicles and regions to ignore of one image. `rows`: where the teacher looked; boxes that end there are cut off."""
    out: list[np.ndarray] = []
    out_kinds: list[int] = []
    overlap = iou(labels, boxes) * (scores >= options.beside_label) if len(boxes) else np.zeros((len(labels), 0))
    free = np.ones(len(boxes), bool)
    for index in np.argsort(-overlap.max(1, initial=0), kind="stable"):
        label = labels[index]
        candidates = overlap[index] * free
        best = int(candidates.argmax()) if len(boxes) else -1
        height = label[3] - label[1]
        if best >= 0 and candidates[best] >= options.same:
            free[best] = False
            cut = boxes[best, 1] <= rows[0] + 2 or boxes[best, 3] >= rows[1] - 2
            out.append(label if cut else boxes[best])
            out_kinds.append(int(kinds[best]) if height >= options.least_height else IGNORE)
        else:
            out.append(label)
            out_kinds.append(CAR if height >= options.least_height_alone else IGNORE)
    for box, score, kind in zip(boxes[free], scores[free], kinds[free]):
        large = max(box[2] - box[0], box[3] - box[1]) >= options.large_px
        if score < (options.doubtful_large if large else options.doubtful):
            continue
        sure = score >= options.sure and box[3] - box[1] >= options.least_height
        out.append(box)
        out_kinds.append(int(kind) if sure else IGNORE)
    return np.array(out, np.float32).reshape(-1, 4), np.array(out_kinds, np.int64)


def fuse_source(folder: Path, labels_csv: Path | None, options: FuseOptions = FuseOptions()) -> None:
    """Writes `boxes.npz` of a folder that `label_images` has filled; without labels the teacher alone counts."""
    with np.load(folder / "teacher.npz") as teacher:
        frame, boxes, score, kind = (teacher[k] for k in ("frame", "boxes", "score", "kind"))
        names, rows = teacher["names"].tolist(), tuple(teacher["rows"].tolist())
    labels = read_labels(labels_csv, names) if labels_csv else [np.zeros((0, 4), np.float32)] * len(names)
    parts = []
    for index in range(len(names)):
        own = frame == index
        fused, kinds = fuse(labels[index], boxes[own], score[own], kind[own], rows, options)
        parts.append((np.full(len(kinds), index, np.int32), fused, kinds))
    write_boxes(folder, *(np.concatenate(column) for column in zip(*parts)))


def write_boxes(folder: Path, frame: np.ndarray, boxes: Boxes, kind: np.ndarray) -> None:
    """Writes `boxes.npz`."""
    np.savez(folder / "boxes.npz", frame=frame, boxes=boxes, kind=kind)
