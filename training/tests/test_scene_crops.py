"""Boxes of training crops lie where the picture has them."""

import cv2
import numpy as np
import pytest

from motorcade_training.scene.augment import CropOptions, move, of_indices, window
from motorcade_training.scene.source import Sample


def extent(image: np.ndarray) -> np.ndarray:
    """Edges of a bright rectangle to a fraction of a pixel: [x1, y1, x2, y2], pixel i covers [i, i + 1)."""
    level = image.astype(float) / 255
    columns, rows = level.max(0), level.max(1)
    edges = []
    for line in (columns, rows):
        inside = np.flatnonzero(line > 0.5)
        low, high = inside[0], inside[-1]
        edges.append((low + 1 - line[low] - (line[low - 1] if low else 0), high + line[high] + (line[high + 1] if high + 1 < len(line) else 0)))
    (x1, x2), (y1, y2) = edges
    return np.array([x1, y1, x2, y2])


@pytest.mark.parametrize("blurred", [False, True])
def test_boxes_and_picture_are_not_shifted(blurred):
    image = np.zeros((180, 320), np.uint8)
    image[70:130, 120:220] = 255
    sample = Sample(image, np.zeros((90, 160), np.uint8), np.array([[120, 70, 220, 130]], np.float32), np.zeros(1, np.int64))
    random, errors = np.random.default_rng(4), []
    while len(errors) < 60:
        matrix = window(sample, (192, 352), CropOptions(), random)
        # Turned ones have no edges along rows and columns.
        matrix[0, 1] = matrix[1, 0] = 0.0
        if (abs(matrix[1, 1]) < 0.75) != blurred:
            continue
        source, middle = (cv2.blur(image, (2, 2)), 0.0) if blurred else (image, 0.5)
        warped = cv2.warpAffine(source, of_indices(matrix, middle), (352, 192), flags=cv2.INTER_LINEAR)
        box = move(sample.boxes, matrix)[0]
        if box.min() < 4 or box[2] > 348 or box[3] > 188:
            continue
        errors.append(extent(warped) - box)
    assert np.abs(np.mean(errors, 0)).max() < 0.08
    assert np.abs(errors).max() < 0.6
