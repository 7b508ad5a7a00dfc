"""Labelled drives of the project's simulator, and their labels as the training uses them."""

import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from motorcade_training.common.seeds import generator
from motorcade_training.scene.classes import BUS, CAR, MOTORCYCLE, TRUCK
from motorcade_training.scene.label import read_rgb

#: Scenarios whose pictures differ; those that only disturb the simulated detector are left out.
SCENARIOS = (
    "demo bends slope stop-and-go standing-start roundabout oncoming crossing overtaking turning parked rough truck dense "
    "empty crowd pitched rolled low-camera high-camera lorries "
    "parked-across yard double-parked roundabout-exits junction-turn trailers motorway crest block tunnel"
).split()
WEATHERS = ("clear", "overcast", "rain")
WIDTHS_PX = (1242, 1242, 960)
KINDS = {"Car": CAR, "Van": CAR, "Truck": TRUCK, "Bus": BUS, "Tram": BUS, "Motorcycle": MOTORCYCLE}
#: A vehicle of which less than this is in sight is an ignore region.
LEAST_VISIBLE = 0.3


def render(simulator: Path, out: Path, frames: int, per_drive: int, seed: int, workers: int = 1) -> list[Path]:
    """Renders short drives with `motorcade simulate`, `workers` at a time, until there are `frames` pictures; keeps drives that are there."""
    drives, commands = [], []
    for index in range(-(-frames // per_drive)):
        random = generator(seed, "drive", index)
        scenario = SCENARIOS[index % len(SCENARIOS)]
        weather, width = random.choice(WEATHERS), random.choice(WIDTHS_PX)
        drive = out / f"{index:04}-{scenario}"
        drives.append(drive)
        if (drive / "training" / "label_02" / "0000.txt").is_file():
            continue
        command = [simulator, "simulate", "--scenario", scenario, "--weather", weather, "--width", width]
        command += ["--frames", per_drive, "--seed", int(random.integers(1 << 31)), "--instance", "--force"]
        command += ["--exposure-drift", f"{random.uniform(0, 0.2):.2f}", "--out", drive, "--progress", "none"]
        commands.append([str(word) for word in command])
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(lambda command: subprocess.run(command, check=True, stdout=subprocess.DEVNULL), commands))
    return drives


def extent(mask: np.ndarray) -> tuple[np.ndarray, int] | None:
    """Box around the pixels of a mask, f32 [4] px, where pixel i covers [i, i + 1), and their number; `None` without any."""
    columns, rows = np.flatnonzero(mask.any(0)), np.flatnonzero(mask.any(1))
    if not len(columns):
        return None
    return np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], np.float32), int(mask.sum())


@dataclass
class Render:
    """One labelled picture."""

    #: u8 [H, W, 3], RGB.
    image: np.ndarray
    #: Probability of road, u8 [H, W], 255 for certain.
    road: np.ndarray
    #: f32 [N, 4] px; pixel i covers [i, i + 1).
    boxes: np.ndarray
    #: i64 [N], -1 for regions to ignore.
    kinds: np.ndarray


def read_labels(drive: Path) -> dict[int, list[list[str]]]:
    """Words of the labels of a simulated drive by frame."""
    labels: dict[int, list[list[str]]] = {}
    for line in (drive / "training" / "label_02" / "0000.txt").read_text().splitlines():
        words = line.split()
        labels.setdefault(int(words[0]), []).append(words)
    return labels


def read_drive(drive: Path) -> Iterator[Render]:
    """The labelled pictures of a simulated drive. Boxes enclose what shows of a vehicle, as those of the teacher and of `VisibleExtent` in the
    product do; KITTI's, around the corners of the 3D box, are some percent larger. Hidden vehicles are regions to ignore."""
    root = drive / "training"
    labels = read_labels(drive)
    for path in sorted((root / "image_02" / "0000").glob("*.png")):
        road = cv2.imread(str(root / "road_masks" / "0000" / path.name), cv2.IMREAD_GRAYSCALE)
        instance = cv2.imread(str(root / "instance" / "0000" / path.name), cv2.IMREAD_UNCHANGED)
        boxes, kinds = [], []
        for words in labels.get(int(path.stem), []):
            if words[2] not in KINDS:
                continue
            corners = np.array(words[6:10], np.float32)
            seen = extent(instance == int(words[1]) + 1)
            # A vehicle fills about three quarters of the box around its corners.
            share = 0.0 if seen is None else seen[1] / max(0.75 * (corners[2] - corners[0]) * (corners[3] - corners[1]), 1)
            shows = seen is not None and share >= LEAST_VISIBLE and int(words[4]) < 3
            boxes.append(seen[0] if shows else corners)
            kinds.append(KINDS[words[2]] if shows else -1)
        yield Render(read_rgb(path), road, np.array(boxes, np.float32).reshape(-1, 4), np.array(kinds, np.int64))
