"""Intrinsics of a camera."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Union

from . import _native

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


COEFFICIENTS = {
    "radial-tangential": ("k1", "k2", "p1", "p2", "k3"),
    "rational": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "fisheye": ("k1", "k2", "k3", "k4"),
}
"""Coefficients of each model of a lens, in OpenCV's order."""


@dataclass(frozen=True)
class Camera:
    """Intrinsics of a camera in pixels, pixel centres at integer coordinates, of the frames as they come in.

    `distortion` holds the coefficients of `model` in OpenCV's order: k1, k2, p1, p2, k3 of "radial-tangential"; these and k4, k5,
    k6 of "rational"; k1, k2, k3, k4 of "fisheye" (Kannala-Brandt); those left out are 0. `view_deg` is the horizontal view of the
    undistorted frames, where it is stated. `fps`, `height_m` (height above the road) and `readout_ms` (time from the first row to the
    last of a rolling shutter, 0 without) stand in some calibration files.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int | None = None
    height: int | None = None
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    fps: float | None = None
    height_m: float | None = None
    model: str = "radial-tangential"
    view_deg: float | None = None
    readout_ms: float | None = None

    def __post_init__(self) -> None:
        names = COEFFICIENTS.get(self.model)
        if names is None:
            known = ", ".join(COEFFICIENTS)
            raise _native.SettingsError(f"camera: model {self.model!r} is none of {known}")
        found, most = len(self.distortion), len(names)
        if found > most:
            raise _native.SettingsError(f"camera: distortion of a {self.model} lens has {most} coefficients, got {found}")

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, camera: int | None = None) -> Camera:
        """Reads a calibration file: this project's TOML, KITTI calib.txt, OpenCV or ORB-SLAM YAML, ROS camera_info YAML, Kalibr.

        `camera` chooses among the cameras of a KITTI or Kalibr file. Raises `InputError`.
        """
        return cls(**_native.read_calibration(os.fspath(path), camera))

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The matrix K, shape [3, 3]."""
        import numpy as np

        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def distorted(self) -> bool:
        """True with any distortion; a fisheye lens has one with coefficients 0 too."""
        return self.model == "fisheye" or any(coefficient != 0.0 for coefficient in self.distortion)

    def to_toml(self) -> str:
        """This project's calibration file, which `run` and the program read."""
        fields = ("fx", "fy", "cx", "cy", "width", "height", "fps", "height_m", "view_deg", "readout_ms")
        values = [(name, getattr(self, name)) for name in fields]
        text = "".join(f"{name} = {_number(name, value)}\n" for name, value in values if value is not None)
        if self.distorted:
            pairs = zip(COEFFICIENTS[self.model], self.distortion)
            model = "" if self.model == "radial-tangential" else f'model = "{self.model}"\n'
            text += f"[distortion]\n{model}" + "".join(f"{name} = {float(value)!r}\n" for name, value in pairs)
        return text


def _number(name: str, value: float) -> str:
    return str(int(value)) if name in ("width", "height") else repr(float(value))


CameraArgument = Union[Camera, Mapping[str, Any], str, "os.PathLike[str]"]
"""A camera: as an object, as a dictionary of its fields, or as a calibration file."""


def camera_of(argument: CameraArgument) -> Camera:
    """The camera that an argument means."""
    if isinstance(argument, Camera):
        return argument
    if isinstance(argument, Mapping):
        try:
            return Camera(**argument)
        except TypeError as error:
            raise _native.SettingsError(f"camera: {error}") from None
    if isinstance(argument, (str, os.PathLike)):
        return Camera.read(argument)
    kind = type(argument).__name__
    raise _native.SettingsError(f"camera: expected a Camera, a dictionary or a calibration file, got {kind}")
