"""Detections as CSV for an independent judge, and agreement of the road with the teacher."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from motorcade_training.scene.label import read_rgb
from motorcade_training.scene.runner import SceneRunner
from motorcade_training.scene.teacher import BoxTeacher, RoadTeacher


@dataclass(frozen=True)
class Camera:
    """A level camera above a level road."""

    focal_px: float
    cx_px: float
    cy_px: float
    height_m: float = 1.65


#: Half the width of the own lane and how far it counts [m].
LANE_HALF_M, LANE_FAR_M = 1.75, 30.0


def lane_mask(camera: Camera, height: int, width: int) -> np.ndarray:
    """Pixels of the own lane, bool [height, width]."""
    v, u = np.mgrid[:height, :width].astype(np.float64)
    z_m = camera.focal_px * camera.height_m / np.maximum(v - camera.cy_px, 1e-6)
    x_m = (u - camera.cx_px) / camera.focal_px * z_m
    return (v > camera.cy_px) & (z_m < LANE_FAR_M) & (np.abs(x_m) < LANE_HALF_M)


def write_detections(path: Path, frames: list[Path], detect: Callable) -> float:
    """Writes `frame,x1,y1,x2,y2,score`; `detect(image)` gives boxes and scores first. Milliseconds a frame."""
    path.parent.mkdir(parents=True, exist_ok=True)
    spent_s = 0.0
    with path.open("w") as file:
        file.write("frame,x1,y1,x2,y2,score\n")
        for frame in frames:
            image = read_rgb(frame)
            start = time.process_time()
            boxes, scores = detect(image)[:2]
            spent_s += time.process_time() - start
            for box, score in zip(boxes, scores):
                corners = ",".join(f"{value:.2f}" for value in box)
                file.write(f"{int(frame.stem)},{corners},{score:.4f}\n")
    return 1000 * spent_s / max(len(frames), 1)


def road_agreement(runner: SceneRunner, teacher: RoadTeacher, frames: list[Path], camera: Camera | None) -> dict[str, float]:
    """IoU of the road with the teacher's over all pixels, and inside the own lane."""
    common, either = np.zeros(2), np.zeros(2)
    for frame in frames:
        image = read_rgb(frame)
        ours = runner(image)[3] > 0.5
        theirs = cv2.resize(teacher(image), (image.shape[1], image.shape[0])) > 0.5
        regions = [np.ones(ours.shape, bool)] + ([lane_mask(camera, *ours.shape)] if camera else [])
        for index, region in enumerate(regions):
            common[index] += (ours & theirs & region).sum()
            either[index] += ((ours | theirs) & region).sum()
    ious = common / np.maximum(either, 1)
    return {"road_iou": float(ious[0])} | ({"own_lane_iou": float(ious[1])} if camera else {})


@dataclass(frozen=True)
class EvaluateOptions:
    """What is evaluated."""

    network: Path
    frames: Path
    first: int
    last: int
    size: tuple[int, int]
    detections: Path | None
    #: Folder of the teachers; their detections and the road are compared.
    models: Path | None
    teacher_detections: Path | None
    camera: Camera | None
    every: int


def evaluate(options: EvaluateOptions) -> None:
    """Prints the agreement of the road and writes detections of the network and, if wanted, of YOLOX-Nano."""
    frames = sorted(p for p in options.frames.iterdir() if p.stem.isdigit() and options.first <= int(p.stem) <= options.last)
    if not frames:
        raise ValueError(f"{options.frames}: no numbered frames from {options.first} to {options.last}")
    runner = SceneRunner(options.network, *options.size)
    if options.detections is not None:
        spent = write_detections(options.detections, frames, runner)
        print(f"{len(frames)} frames, {spent:.1f} ms of processor time a frame -> {options.detections}")
    if options.models is not None:
        if options.teacher_detections is not None:
            height, width = read_rgb(frames[0]).shape[:2]
            teacher = BoxTeacher(options.models, width, (0, height), 1.0, mirror=False)
            spent = write_detections(options.teacher_detections, frames, teacher)
            print(f"YOLOX-Nano: {spent:.1f} ms of processor time a frame -> {options.teacher_detections}")
        road = RoadTeacher(options.models, (256, 832), mirror=False)
        for name, value in road_agreement(runner, road, frames[:: options.every], options.camera).items():
            print(f"{name} {value:.3f}")
