"""Sheets of crops with keypoints, to look at. Sheets of frames under other licences are not to be committed."""

from pathlib import Path

import numpy as np

from motorcade_training.vehicle.decode import Keypoints
from motorcade_training.vehicle.layout import DEVIATION, INPUT_PX, MEAN

ZOOM = 3
COLUMNS = 10


def tile(crop: np.ndarray, keypoints: Keypoints, text: str) -> np.ndarray:
    """One crop (4, 64, 64) with its keypoints: left red, right blue; the seen ones filled."""
    import cv2

    image = np.clip((crop[:3].transpose(1, 2, 0) * DEVIATION + MEAN) * 255, 0, 255).astype(np.uint8)
    image = cv2.resize(image, None, fx=ZOOM, fy=ZOOM, interpolation=cv2.INTER_CUBIC)
    for i, (place, seen) in enumerate(zip(keypoints.place, keypoints.visibility, strict=True)):
        at = tuple(int(v) for v in place * INPUT_PX * ZOOM)
        colour = (255, 40, 40) if i < 18 else (60, 120, 255)
        if seen > 0.5:
            cv2.circle(image, at, 2, colour, -1)
        elif seen > 0.2:
            cv2.circle(image, at, 2, colour, 1)
    cv2.putText(image, text, (2, 10), cv2.FONT_HERSHEY_SIMPLEX, 0.35, (255, 255, 0), 1)
    return image


def sheet(tiles: list[np.ndarray], path: Path) -> None:
    """Tiles in rows, as a PNG."""
    import cv2

    side = INPUT_PX * ZOOM
    rows = -(-len(tiles) // COLUMNS)
    out = np.zeros((rows * side, COLUMNS * side, 3), np.uint8)
    for i, one in enumerate(tiles):
        y, x = divmod(i, COLUMNS)
        out[y * side : (y + 1) * side, x * side : (x + 1) * side] = one
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), out[..., ::-1])
