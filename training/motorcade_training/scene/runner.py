"""Runs networks on whole pictures: ours and the teachers', all from ONNX files in ONNX Runtime."""

from pathlib import Path

import cv2
import numpy as np
import onnxruntime

from motorcade_training.scene.boxes import Boxes
from motorcade_training.scene.decode import decode_boxes
from motorcade_training.scene.teacher import PAD


def letterbox(image: np.ndarray, height: int, width: int) -> tuple[np.ndarray, float]:
    """The image scaled (bilinear, as the product does) into the upper left corner of a grey canvas, and the scale."""
    scale = min(width / image.shape[1], height / image.shape[0])
    size = (round(image.shape[1] * scale), round(image.shape[0] * scale))
    canvas = np.full((height, width, 3), PAD, np.uint8)
    canvas[: size[1], : size[0]] = cv2.resize(image, size, interpolation=cv2.INTER_LINEAR)
    return canvas, scale


class SceneRunner:
    """The scene network of an ONNX file."""

    def __init__(self, path: Path, height: int, width: int):
        """`height` and `width` of the input [px], multiples of 32."""
        if not path.is_file():
            raise ValueError(f"{path}: no such network")
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        self.height, self.width = height, width

    def __call__(self, image: np.ndarray, least_score: float = 0.1) -> tuple[Boxes, np.ndarray, np.ndarray, np.ndarray]:
        """Boxes [px of `image`, RGB], scores, classes and the probability of road, f32 of the image's size."""
        canvas, scale = letterbox(image, self.height, self.width)
        tensor = canvas.transpose(2, 0, 1)[None].astype(np.float32) / 255
        outputs = self.session.run(None, {"image": tensor})
        boxes, scores, kinds = decode_boxes(outputs[:2], least_score)
        limit = np.array([image.shape[1], image.shape[0]] * 2, np.float32)
        road = cv2.resize(outputs[2][0, 0], (self.width, self.height), interpolation=cv2.INTER_LINEAR)
        inside = road[: round(image.shape[0] * scale), : round(image.shape[1] * scale)]
        road = cv2.resize(inside, (image.shape[1], image.shape[0]), interpolation=cv2.INTER_LINEAR)
        return np.clip(boxes / scale, 0, limit), scores, kinds, road
