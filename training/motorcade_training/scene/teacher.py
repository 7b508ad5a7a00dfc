"""The teachers: YOLOX-Nano for vehicle boxes and road-segmentation-adas-0001 for the road, both Apache-2.0, in ONNX Runtime.

Both are fully convolutional, so their fixed input size is replaced by the one that suits the images.
"""

from pathlib import Path

import cv2
import numpy as np
import onnx
import onnxruntime
from numpy.typing import NDArray

from motorcade_training.scene.boxes import Boxes, iou, suppress
from motorcade_training.scene.classes import FROM_COCO

YOLOX_FILE = "yolox_nano_384x1248.onnx"
ROAD_FILE = "road_seg_adas_0001_256x832.onnx"
#: Boxes below this score are not written down.
LEAST_SCORE = 0.05
#: Value of the pixels beside a letterboxed image.
PAD = 114


def session(path: Path, height: int, width: int) -> onnxruntime.InferenceSession:
    """The network of `path` with the input `[1, 3, height, width]`."""
    model = onnx.load(str(path))
    for value, sizes in ((model.graph.input[0], (height, width)), (model.graph.output[0], (0, 0))):
        for dimension, size in zip(value.type.tensor_type.shape.dim[2:], sizes):
            dimension.Clear()
            if size:
                dimension.dim_value = size
        if not sizes[0]:
            del value.type.tensor_type.shape.dim[:]
            value.type.tensor_type.ClearField("shape")
    del model.graph.value_info[:]
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])


class BoxTeacher:
    """YOLOX at a multiple of the image's size, on the image and its mirror image."""

    def __init__(self, models: Path, width: int, rows: tuple[int, int], scale: float, mirror: bool = True):
        """`width` of the images [px]; `rows`: first row and the one after the last that are looked at."""
        self.scale, self.mirror, self.rows = scale, mirror, rows
        self.size = (round((rows[1] - rows[0]) * scale), round(width * scale))
        self.padded = tuple(-(-side // 32) * 32 for side in self.size)
        self.session = session(models / YOLOX_FILE, *self.padded)
        cells = []
        for stride in (8, 16, 32):
            y, x = np.mgrid[: self.padded[0] // stride, : self.padded[1] // stride]
            cells.append(np.stack([x.ravel(), y.ravel(), np.full(x.size, stride)], 1))
        self.cells = np.concatenate(cells).astype(np.float32)

    def __call__(self, image: NDArray[np.uint8]) -> tuple[Boxes, NDArray[np.float32], NDArray[np.int64]]:
        """Boxes [px of `image`, RGB], scores and our classes, best first."""
        width = image.shape[1]
        views = [self._one(image)]
        if self.mirror:
            boxes, scores, classes = self._one(np.ascontiguousarray(image[:, ::-1]))
            mirrored = np.stack([width - boxes[:, 2], boxes[:, 1], width - boxes[:, 0], boxes[:, 3]], 1)
            views.append((mirrored, scores, classes))
        return merge(views)

    def _one(self, image: NDArray[np.uint8]) -> tuple[Boxes, NDArray[np.float32], NDArray[np.int64]]:
        canvas = np.full((*self.padded, 3), PAD, np.uint8)
        height, width = self.size
        canvas[:height, :width] = cv2.resize(image[slice(*self.rows)], (width, height))
        tensor = canvas[..., ::-1].transpose(2, 0, 1)[None].astype(np.float32)
        raw = self.session.run(None, {"images": tensor})[0][0]
        wanted = np.array(list(FROM_COCO))
        scores = raw[:, 4:5] * raw[:, 5 + wanted]
        best = scores.argmax(1)
        score = scores[np.arange(len(raw)), best]
        keep = score > LEAST_SCORE
        raw, cells, score, best = raw[keep], self.cells[keep], score[keep], best[keep]
        centre = (raw[:, :2] + cells[:, :2]) * cells[:, 2:]
        half = np.exp(raw[:, 2:4]) * cells[:, 2:] / 2
        boxes = np.concatenate([centre - half, centre + half], 1) / self.scale
        boxes[:, 1::2] += self.rows[0]
        low, high = (0, self.rows[0]) * 2, (image.shape[1], self.rows[1]) * 2
        boxes = np.clip(boxes, low, high).astype(np.float32)
        kept = suppress(boxes, score, 0.5)
        return boxes[kept], score[kept], np.array(list(FROM_COCO.values()))[best[kept]]


def merge(views: list[tuple[Boxes, NDArray[np.float32], NDArray[np.int64]]]):
    """Boxes of several views of one image: those that agree are averaged by score; the score is the mean over all views."""
    boxes = np.concatenate([v[0] for v in views])
    scores = np.concatenate([v[1] for v in views])
    classes = np.concatenate([v[2] for v in views])
    view = np.concatenate([np.full(len(v[1]), i) for i, v in enumerate(views)])
    found: list[tuple[NDArray[np.float32], float, int]] = []
    free = np.ones(len(scores), bool)
    for first in np.argsort(-scores, kind="stable"):
        if not free[first]:
            continue
        overlap = iou(boxes[first : first + 1], boxes)[0] * free
        members = [first]
        for other in range(len(views)):
            candidates = np.flatnonzero((view == other) & (overlap > 0.55))
            if other != view[first] and len(candidates):
                members.append(candidates[overlap[candidates].argmax()])
        free[members] = False
        weight = scores[members] / scores[members].sum()
        found.append((weight @ boxes[members], float(scores[members].sum()) / len(views), int(classes[first])))
    if not found:
        return np.zeros((0, 4), np.float32), np.zeros(0, np.float32), np.zeros(0, np.int64)
    out = (np.array([f[0] for f in found], np.float32), np.array([f[1] for f in found], np.float32))
    order = np.argsort(-out[1], kind="stable")
    return out[0][order], out[1][order], np.array([f[2] for f in found])[order]


class RoadTeacher:
    """Probability that a pixel is road or lane mark, mean over the image and its mirror image."""

    def __init__(self, models: Path, input_size: tuple[int, int], mirror: bool = True):
        """`input_size`: height and width of the network's input [px], multiples of 32."""
        self.input_size, self.mirror = input_size, mirror
        self.session = session(models / ROAD_FILE, *input_size)

    def __call__(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """`image` is RGB; the result has the size of the network's input."""
        height, width = self.input_size
        resized = cv2.resize(image, (width, height), interpolation=cv2.INTER_LINEAR)
        road = self._one(resized)
        if self.mirror:
            road = (road + self._one(resized[:, ::-1])[:, ::-1]) / 2
        return road

    def _one(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        tensor = np.ascontiguousarray(image[..., ::-1].transpose(2, 0, 1)[None]).astype(np.float32)
        probabilities = self.session.run(None, {"data": tensor})[0][0]
        return probabilities[1] + probabilities[3]
