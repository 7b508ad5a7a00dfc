"""Boxes and road from the outputs of the ONNX file; the specification of the decoder in Rust."""

import numpy as np

from motorcade_training.scene.boxes import Boxes, average, suppress
from motorcade_training.scene.classes import CLASSES
from motorcade_training.scene.model import BOX_STRIDES

#: Boxes of any class that overlap more are one vehicle; those that overlap the best one by the second limit are averaged with it.
SAME_IOU, AVERAGED_IOU = 0.5, 0.6


def decode_boxes(outputs: list[np.ndarray], least_score: float = 0.05, limit: float = SAME_IOU) -> tuple[Boxes, np.ndarray, np.ndarray]:
    """Boxes [N, 4] in input pixels, scores [N] and classes [N], best first, of `boxes8` and `boxes16`, each [1, C + 4, h, w].

    A pixel with index i covers [i, i + 1): box edges are positions between pixels, 0 is the left edge of the picture.
    """
    boxes, scores, kinds = [], [], []
    for output, stride in zip(outputs, BOX_STRIDES, strict=True):
        classes = output[0, : len(CLASSES)]
        kind, score = classes.argmax(0), classes.max(0)
        y, x = np.nonzero(score > least_score)
        left, top, right, low = output[0, len(CLASSES) :, y, x].T
        centre_x, centre_y = (x + 0.5) * stride, (y + 0.5) * stride
        boxes.append(np.stack([centre_x - left, centre_y - top, centre_x + right, centre_y + low], 1))
        scores.append(score[y, x])
        kinds.append(kind[y, x])
    found, score, kind = np.concatenate(boxes).astype(np.float32), np.concatenate(scores), np.concatenate(kinds)
    kept = suppress(found, score, limit)
    return average(found, score, kept, AVERAGED_IOU), score[kept], kind[kept]
