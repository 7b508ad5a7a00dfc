"""The ground of a picture in perspective."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Ground:
    """Coordinates of the ground by pixel, for a level camera over a level road."""

    across: np.ndarray  #: To the right of the vanishing point, in heights of the camera, f32 [H, W].
    along: np.ndarray  #: Ahead, in shares of an unknown focal length, f32 [H, 1].
    rows: np.ndarray  #: Below the vanishing point [px], 0 above, f32 [H, 1].

    @classmethod
    def below(cls, vanishing: tuple[float, float], height: int, width: int) -> "Ground":
        """The ground below a vanishing point, x and y [px]. The first rows below it are far away and are left out."""
        x = np.arange(width, dtype=np.float32)[None] - vanishing[0]
        y = np.arange(height, dtype=np.float32)[:, None] - vanishing[1]
        depth = 1 / np.maximum(y, 1.5)
        return cls((x * depth).astype(np.float32), (depth * height).astype(np.float32), np.where(y > 1.5, y, 0).astype(np.float32))
