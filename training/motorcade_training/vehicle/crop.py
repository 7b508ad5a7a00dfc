"""Cutting a box out of a picture as the product does; the reference for it.

The crop is the box times `MARGIN` about its middle, stretched to 64 x 64. Along each axis the picture is averaged over the input
pixel's extent where that is wider than a pixel of the picture, else interpolated linearly between pixel centres. Input pixels
whose middle lies outside the picture are 0 after normalisation.
"""

from dataclasses import dataclass

import numpy as np

from motorcade_training.vehicle.layout import DEVIATION, INPUT_PX, MARGIN, MEAN


@dataclass(frozen=True)
class CropFrame:
    """Place of a crop in the picture; edges [px], pixel centres at integers (a picture begins at -0.5)."""

    x1: float
    y1: float
    width: float
    height: float

    @classmethod
    def of_box(cls, box: tuple[float, float, float, float]) -> "CropFrame":
        """Of a box x1, y1, x2, y2 [px]."""
        x1, y1, x2, y2 = box
        width, height = MARGIN * (x2 - x1), MARGIN * (y2 - y1)
        return cls(0.5 * (x1 + x2) - 0.5 * width, 0.5 * (y1 + y2) - 0.5 * height, width, height)

    def pixels(self, place: np.ndarray) -> np.ndarray:
        """(..., 2) from 0..1 in the crop to pixels of the picture."""
        return place * [self.width, self.height] + [self.x1, self.y1]


def axis_weights(start: float, extent: float, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of weights (64, size) over the picture's pixels along one axis, and which input pixels lie inside."""
    step = extent / INPUT_PX
    centres = start + (np.arange(INPUT_PX) + 0.5) * step
    pixels = np.arange(size)
    if step > 1:
        low, high = centres[:, None] - 0.5 * step, centres[:, None] + 0.5 * step
        weights = np.clip(np.minimum(high, pixels + 0.5) - np.maximum(low, pixels - 0.5), 0, None)
    else:
        held = np.clip(centres, 0, size - 1)[:, None]
        weights = np.clip(1 - np.abs(held - pixels), 0, None)
    inside = (centres >= -0.5) & (centres <= size - 0.5)
    total = weights.sum(axis=1, keepdims=True)
    return np.where(total > 0, weights / np.maximum(total, 1e-9), 0), inside


def cut(picture: np.ndarray, box: tuple[float, float, float, float]) -> tuple[np.ndarray, CropFrame]:
    """(4, 64, 64) f32 input of the network for a box of an RGB picture (H, W, 3) u8, and its frame."""
    frame = CropFrame.of_box(box)
    rows, in_rows = axis_weights(frame.y1, frame.height, picture.shape[0])
    columns, in_columns = axis_weights(frame.x1, frame.width, picture.shape[1])
    # Only the part that is read; the weights elsewhere are zero.
    y, x = np.nonzero(rows.any(axis=0))[0], np.nonzero(columns.any(axis=0))[0]
    out = np.zeros((4, INPUT_PX, INPUT_PX), np.float32)
    if len(x) and len(y):
        part = picture[y[0] : y[-1] + 1, x[0] : x[-1] + 1].astype(np.float32)
        image = np.einsum("iy,yxc,jx->cij", rows[:, y[0] : y[-1] + 1], part, columns[:, x[0] : x[-1] + 1], optimize=True)
        inside = in_rows[:, None] & in_columns[None]
        out[:3] = np.where(inside, (image / 255 - MEAN) / DEVIATION, 0)
    out[3] = np.log(frame.width / frame.height)
    return out, frame
