"""Judges the network on KITTI tracking frames: headings of labelled boxes, by the network's bins and by a fit of the shape
prior to its keypoints. For judging alone: nothing here chooses a checkpoint or a setting."""

import argparse
import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from motorcade_training.common import checkpoint
from motorcade_training.vehicle import calibration, crop, kitti, picture
from motorcade_training.vehicle.decode import Keypoints, decode_heading, decode_keypoints
from motorcade_training.vehicle.fit import Prior, fit
from motorcade_training.vehicle.mirror import with_mirrored
from motorcade_training.vehicle.model import VehicleNet

#: Below this height a vehicle is told separately [px].
LEAST_PX = 40.0
#: Groups of the table: name, test.
GROUPS = {
    "whole, unoccluded, >= 40 px": lambda b: b.whole and b.occluded == 0 and b.height_px >= LEAST_PX,
    "whole, unoccluded, 20-40 px": lambda b: b.whole and b.occluded == 0 and 20 <= b.height_px < LEAST_PX,
    "whole, occluded, >= 40 px": lambda b: b.whole and b.occluded > 0 and b.height_px >= LEAST_PX,
    "whole, occluded, 20-40 px": lambda b: b.whole and b.occluded > 0 and 20 <= b.height_px < LEAST_PX,
    "cut off, >= 40 px": lambda b: not b.whole and b.height_px >= LEAST_PX,
}


@dataclass
class Judged:
    """One box: what it is like and how far the headings are off."""

    drive: str
    frame: int
    track: int
    height_px: float
    occluded: int
    whole: bool
    bins_off_rad: float
    fit_off_rad: float
    rival_share: float
    #: Median distance of projected prior points is not known on real frames: the fit's cost instead.
    cost: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of `evaluate vehicle`."""
    parser.add_argument("--kitti", type=Path, help="KITTI tracking split (training), with --prior")
    parser.add_argument("--crops", type=Path, help="folder of rendered crops whose last 1024 were not trained on")
    parser.add_argument("--drives", nargs="+", default=["0005:3", "0003:2"], help="sequence:camera")
    parser.add_argument("--prior", type=Path, help="file of `motorcade shape export`")
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--checkpoint", type=Path)
    source.add_argument("--onnx", type=Path)
    parser.add_argument("--stride", type=int, default=1, help="every n-th frame")
    parser.add_argument("--out", type=Path, help="table of all boxes as CSV")
    parser.add_argument("--sheet", type=Path, help="picture of some boxes, most of them with the largest errors")


def network(options: argparse.Namespace):
    """A function from inputs (N, 4, 64, 64) to a list of outputs."""
    if options.onnx:
        import onnxruntime

        session = onnxruntime.InferenceSession(str(options.onnx), providers=["CPUExecutionProvider"])
        return lambda x: session.run(None, {"crop": x})
    model = VehicleNet()
    model.load_state_dict({k: v.float() for k, v in checkpoint.read(options.checkpoint)["ema"].items()}, strict=False)
    model.eval()

    @torch.no_grad()
    def infer(x: np.ndarray) -> list[np.ndarray]:
        return [o.numpy() for o in model(torch.from_numpy(x))]

    return infer


def run(options: argparse.Namespace) -> None:
    """Prints the table."""
    infer = network(options)
    if options.crops:
        for line in calibration.report(calibration.measure(infer, options.crops, 1024)):
            print(line)
    if not options.kitti:
        return
    if not options.prior:
        raise ValueError("--kitti needs --prior")
    prior = Prior.read(options.prior)
    infer = with_mirrored(infer)
    judged, tiles = [], []
    for drive in options.drives:
        sequence, _, index = drive.partition(":")
        judged += judge_drive(options.kitti, sequence, int(index), options.stride, prior, infer, tiles)
    for line in table(judged):
        print(line)
    if options.out:
        write(options.out, judged)
    if options.sheet:
        picture.sheet(chosen(judged, tiles), options.sheet)


def chosen(judged: list[Judged], tiles: list[np.ndarray]) -> list[np.ndarray]:
    """Three rows of ordinary boxes, three of the worst, spread over the drive."""
    order = np.argsort([box.bins_off_rad for box in judged])
    worst = order[-max(30, len(order) // 12) :]
    rest = order[: len(order) - len(worst)]

    def spread(indices: np.ndarray) -> list[np.ndarray]:
        kept = np.sort(indices)[np.linspace(0, len(indices) - 1, min(30, len(indices))).astype(int)]
        return [tiles[i] for i in kept]

    return spread(rest) + spread(worst)


def judge_drive(
    root: Path, sequence: str, index: int, stride: int, prior: Prior, infer, tiles: list[np.ndarray]
) -> list[Judged]:
    """All labelled boxes of a drive; a picture of each goes to `tiles`."""
    import cv2

    camera = kitti.read_camera(root / "calib" / f"{sequence}.txt", index)
    labels = kitti.read_labels(root / f"label_{index:02}" / f"{sequence}.txt", camera)
    judged = []
    for frame in sorted({label.frame for label in labels})[::stride]:
        folder = root / f"image_{index:02}" / sequence
        path = next(iter(sorted(folder.glob(f"{frame:06}.*"))), None)
        if path is None:
            continue
        frame_rgb = cv2.imread(str(path))[..., ::-1]
        here = [label for label in labels if label.frame == frame and label.box[3] - label.box[1] >= 20]
        if not here:
            continue
        cuts = [crop.cut(frame_rgb, label.box) for label in here]
        heat, visibility, heading, *_ = infer(np.stack([c[0] for c in cuts]))
        for i, label in enumerate(here):
            keypoints = decode_keypoints(heat[i], visibility[i])
            box = judge(label, camera, frame_rgb.shape, cuts[i][1], keypoints, heading[i], prior, sequence)
            judged.append(box)
            off = math.degrees(box.bins_off_rad)
            tiles.append(picture.tile(cuts[i][0], keypoints, f"{sequence} {frame} h{box.height_px:.0f} e{off:.0f}"))
    return judged


def judge(
    label: kitti.Label,
    camera: kitti.Camera,
    shape: tuple[int, ...],
    frame: crop.CropFrame,
    keypoints: Keypoints,
    heading: np.ndarray,
    prior: Prior,
    sequence: str,
) -> Judged:
    """One box."""
    ray = kitti.ray_rad(camera, label.box)
    best, rival = decode_heading(heading)
    pixels = frame.pixels(keypoints.place)
    sigma_px = sigmas(keypoints, frame)
    weight = np.clip(keypoints.visibility, 0.02, 1)
    starts = [best.angle_rad + ray, best.angle_rad + math.pi + ray] + ([rival.angle_rad + ray] if rival.share > 0.1 else [])
    # The network's own share of each heading counts as a prior.
    share = [best.share, 1 - best.share, rival.share]
    fits = [fit(prior, camera, pixels, sigma_px, weight, start) for start in starts]
    found = min(zip(fits, share, strict=False), key=lambda f: f[0].cost - 2 * math.log(max(f[1], 1e-3)))[0]

    def off(angle: float) -> float:
        return abs((angle - label.heading_rad + math.pi) % (2 * math.pi) - math.pi)

    x1, y1, x2, y2 = label.box
    border = x1 <= 1 or y1 <= 1 or x2 >= shape[1] - 2 or y2 >= shape[0] - 2
    return Judged(
        sequence,
        label.frame,
        label.track,
        y2 - y1,
        label.occluded,
        not border and label.truncated < 0.5,
        off(best.angle_rad + ray),
        off(found.heading_rad),
        rival.share,
        found.cost,
    )


def sigmas(keypoints: Keypoints, frame: crop.CropFrame) -> np.ndarray:
    """(36,) standard deviation [px] of the keypoints, from the second moment of the heat maps."""
    moment = 0.5 * (
        keypoints.covariance[:, 0, 0] * frame.width**2 + keypoints.covariance[:, 1, 1] * frame.height**2
    )
    return np.sqrt(np.maximum(0.3 * moment, 0.5**2))


def table(judged: list[Judged]) -> list[str]:
    """A row per group: median error and reversed share, by bins and by the fit."""
    lines = [f"{'boxes':<30} {'n':>5} {'bins med':>9} {'reversed':>9} {'fit med':>9} {'reversed':>9}"]
    for name, test in GROUPS.items():
        group = [b for b in judged if test(b)]
        if not group:
            continue
        bins, fits = (np.array([getattr(b, k) for b in group]) for k in ("bins_off_rad", "fit_off_rad"))
        cells = [f"{math.degrees(np.median(e)):8.1f}° {100 * (e > math.pi / 2).mean():8.1f}%" for e in (bins, fits)]
        lines.append(f"{name:<30} {len(group):>5} {' '.join(cells)}")
    lines.append(votes(judged))
    return lines


def votes(judged: list[Judged]) -> str:
    """Tracks whose median error over all their boxes is more than a quarter turn."""
    tracks: dict[tuple[str, int], list[float]] = {}
    for box in judged:
        tracks.setdefault((box.drive, box.track), []).append(box.bins_off_rad)
    long = [errors for errors in tracks.values() if len(errors) >= 5]
    wrong = sum(float(np.median(errors)) > math.pi / 2 for errors in long)
    return f"tracks of 5 boxes and more: {len(long)}, reversed by the median of their boxes: {wrong}"


def write(path: Path, judged: list[Judged]) -> None:
    """All boxes as CSV."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(Judged.__dataclass_fields__))
        writer.writeheader()
        writer.writerows(vars(box) for box in judged)
