"""A tiny source of pictures: bright rectangles on a dark ground are vehicles, the lower middle is road."""

from pathlib import Path

import numpy as np

from motorcade_training.scene.fuse import write_boxes

COUNT, HEIGHT, WIDTH = 6, 96, 160


def make_source(folder: Path, seed: int = 3) -> Path:
    """Fills `folder` as `make-data` would."""
    random = np.random.default_rng(seed)
    folder.mkdir(parents=True)
    frames = random.integers(20, 60, (COUNT, HEIGHT, WIDTH, 3)).astype(np.uint8)
    road = np.zeros((COUNT, HEIGHT // 2, WIDTH // 2), np.uint8)
    rows = []
    for index in range(COUNT):
        for row in range(24, HEIGHT // 2):
            half = row - 20
            road[index, row, max(40 - half, 0) : 40 + half] = 255
            frames[index, 2 * row : 2 * row + 2, max(80 - 2 * half, 0) : 80 + 2 * half] = 100
        x, y = random.uniform(10, 100), random.uniform(35, 55)
        box = np.array([x, y, x + 40, y + 30], np.float32)
        frames[index, int(y) : int(y) + 30, int(x) : int(x) + 40] = (230, 40, 40)
        rows.append((index, box, index % 4))
    frame = np.array([r[0] for r in rows], np.int32)
    np.save(folder / "frames.npy", frames)
    np.save(folder / "road.npy", road)
    write_boxes(folder, frame, np.stack([r[1] for r in rows]), np.array([r[2] for r in rows], np.int64))
    return folder
