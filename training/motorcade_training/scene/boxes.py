"""Boxes as arrays `[N, 4]` of x1, y1, x2, y2 in pixels."""

import numpy as np
from numpy.typing import NDArray

Boxes = NDArray[np.float32]


def iou(a: Boxes, b: Boxes) -> NDArray[np.float32]:
    """Intersection over union of each pair, `[len(a), len(b)]`."""
    return intersection(a, b) / np.maximum(area(a)[:, None] + area(b)[None] - intersection(a, b), 1e-9)


def intersection(a: Boxes, b: Boxes) -> NDArray[np.float32]:
    """Intersection of each pair in square pixels, `[len(a), len(b)]`."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    return np.prod(np.clip(high - low, 0, None), axis=2)


def area(boxes: Boxes) -> NDArray[np.float32]:
    """Areas in square pixels, `[N]`."""
    return np.clip(boxes[:, 2] - boxes[:, 0], 0, None) * np.clip(boxes[:, 3] - boxes[:, 1], 0, None)


def average(boxes: Boxes, scores: NDArray[np.float32], kept: NDArray[np.int64], limit: float) -> Boxes:
    """Each kept box as the mean of all that overlap it by more than `limit`, weighted by score squared times IoU."""
    overlap = iou(boxes[kept], boxes)
    weight = np.where(overlap > limit, overlap * scores[None] ** 2, 0)
    return (weight @ boxes / np.maximum(weight.sum(1, keepdims=True), 1e-12)).astype(np.float32)


def suppress(boxes: Boxes, scores: NDArray[np.float32], limit: float) -> NDArray[np.int64]:
    """Non-maximum suppression without regard to class: indices of the boxes kept, best first."""
    kept: list[int] = []
    for index in np.argsort(-scores, kind="stable"):
        if not kept or iou(boxes[index : index + 1], boxes[kept]).max() <= limit:
            kept.append(int(index))
    return np.array(kept, np.int64)
