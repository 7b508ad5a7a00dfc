"""Average precision of boxes at IoU 0.5, all classes together."""

import numpy as np

from motorcade_training.scene.boxes import Boxes, area, intersection, iou


class AveragePrecision:
    """Collects images and computes AP with 40 recall positions."""

    def __init__(self) -> None:
        self.scores: list[float] = []
        self.right: list[bool] = []
        self.labelled = 0

    def add(self, boxes: Boxes, scores: np.ndarray, labels: Boxes, ignored: Boxes) -> None:
        """One image; `boxes` best first. Boxes mostly inside ignored regions do not count."""
        self.labelled += len(labels)
        free = np.ones(len(labels), bool)
        overlaps = iou(boxes, labels)
        covered = intersection(boxes, ignored) / np.maximum(area(boxes)[:, None], 1e-9)
        for index, score in enumerate(scores):
            candidates = overlaps[index] * free
            if candidates.max(initial=0) >= 0.5:
                free[candidates.argmax()] = False
                self.scores.append(float(score))
                self.right.append(True)
            elif covered[index].max(initial=0) < 0.5:
                self.scores.append(float(score))
                self.right.append(False)

    def value(self) -> float:
        """AP, 0..1."""
        right = np.array(self.right, bool)[np.argsort(-np.array(self.scores), kind="stable")]
        hits = np.cumsum(right)
        recall, precision = hits / max(self.labelled, 1), hits / np.maximum(np.arange(1, len(right) + 1), 1)
        places = np.linspace(0.025, 1, 40)
        return float(np.mean([precision[recall >= r].max(initial=0) for r in places]))
