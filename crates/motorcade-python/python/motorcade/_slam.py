"""The object that takes frames."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Literal

from . import _drive, _estimate, _native, _progress, _settings
from ._camera import CameraArgument, camera_of
from ._detector import Detector, adapted
from ._drive import Drive
from ._estimate import Estimate

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Motorcade:
    """Monocular multi-body SLAM on the frames of one camera, given one by one.

    >>> slam = motorcade.Motorcade(camera, height_m=1.4)
    >>> for time_ns, image in frames:
    ...     now = slam.step(image, time_ns)
    ...     print(now.speed_mps, len(now.vehicles))
    >>> drive = slam.finish()

    Args:
        camera: `Camera` with width and height, a dictionary of its fields, or a calibration file. Frames must be free of
            distortion.
        height_m: Height of the camera above the road [m]; "auto" estimates it at the end of the drive by the sizes of the cars,
            until then lengths assume 1.5 m.
        detector: Detector of vehicles of your own in place of the network; see `Detector`.
        models: Folder of ONNX networks, or "none"; the networks inside the package by default.
        online: `finish` keeps every frame as it was estimated when it came.
        threads: Threads at the end of the drive; 0 takes all cores, results do not depend on it.
        preset, config, seed, settings: As for `run`.

    Raises `SettingsError`. The interpreter's lock is released while computing.
    """

    def __init__(
        self,
        camera: CameraArgument,
        height_m: float | Literal["auto"] | None = None,
        *,
        detector: Detector | None = None,
        models: str | os.PathLike[str] | None = None,
        online: bool = False,
        threads: int = 1,
        preset: str = "default",
        config: str | os.PathLike[str] | None = None,
        seed: int | None = None,
        **settings: Any,
    ) -> None:
        self.camera = camera = camera_of(camera)
        if camera.width is None or camera.height is None:
            raise _native.SettingsError("camera: width and height are needed")
        if camera.distorted:
            raise _native.SettingsError("camera: frames must be undistorted before; give it without distortion")
        height_m = camera.height_m if height_m is None else height_m
        if height_m is None:
            raise _native.SettingsError('height_m is needed: metres, or "auto"')
        if height_m == "auto" and online:
            raise _native.SettingsError('height_m="auto" is known at the end of a drive only, not online')
        arguments = {
            "intrinsics_px": (camera.fx, camera.fy, camera.cx, camera.cy),
            "size_px": (camera.width, camera.height),
            "readout_ms": camera.readout_ms,
            "height_m": None if height_m == "auto" else float(height_m),
            "models": None if models is None else os.fspath(models),
            "threads": threads,
            "settings": _settings.arguments(preset, config, online, seed, settings),
        }
        self._native = _native.NativeMotorcade(arguments, adapted(detector))

    def step(
        self,
        image: NDArray[np.uint8],
        time_ns: int,
        *,
        number: int | None = None,
        ignore: NDArray[Any] | None = None,
    ) -> Estimate:
        """Takes the next frame and estimates camera, road and vehicles in it.

        `image` has the shape [h, w] or [h, w, 3] (red, green, blue; of OpenCV's pictures give image[..., ::-1]), dtype uint8; it is
        copied once. `time_ns` is after that of the frame before. `number` is the input's own, one more than the last by default.
        `ignore`, shape [h, w], is not zero where pixels are to be ignored. Raises `InputError` and what a detector raises; the
        frame is then not taken, `skip` keeps its row. `KeyboardInterrupt` comes after the frame, which is then taken.
        """
        taken = self._native.take(image, time_ns, number, _mask(ignore), True)
        if taken is None:
            raise _native.InputError("no estimate of this frame")
        return _estimate.from_native(taken)

    def push(
        self,
        image: NDArray[np.uint8],
        time_ns: int,
        *,
        number: int | None = None,
        ignore: NDArray[Any] | None = None,
    ) -> None:
        """As `step` without an estimate: for drives that are only wanted as a whole."""
        self._native.take(image, time_ns, number, _mask(ignore), False)

    def skip(self, time_ns: int, *, number: int | None = None, reason: str = "missing") -> None:
        """Takes a frame that is missing or unreadable: its pose is bridged and its row stays. Raises `InputError`."""
        self._native.skip(time_ns, number, reason)

    def finish(self, *, progress: _progress.ProgressArgument = None) -> Drive:
        """Ends the drive and estimates it once more with all frames.

        Nothing can be given afterwards. An interruption by the keyboard ends it too, without a result.
        """
        with _progress.watched(progress) as call:
            native = self._native.finish(["python", "motorcade.Motorcade"], call)
        return _drive.from_native(native)

    @property
    def warnings(self) -> list[str]:
        """Warnings so far: settings that are rarely meant, frames that were skipped."""
        return self._native.warnings()

    def __len__(self) -> int:
        """Number of frames so far."""
        return len(self._native)


def _mask(ignore: NDArray[Any] | None) -> NDArray[np.uint8] | None:
    import numpy as np

    if ignore is None:
        return None
    mask = np.asarray(ignore)
    return mask.view(np.uint8) if mask.dtype == np.bool_ else mask
