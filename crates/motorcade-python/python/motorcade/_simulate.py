"""Simulated drives."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from . import _native, _progress


@dataclass(frozen=True)
class Simulation:
    """Paths of a simulated drive, in the shape of KITTI tracking."""

    training: Path
    """The split: the input of `run` and the ground truth of `evaluate`."""
    sequence: str
    """Name of the sequence in it."""
    detections: Path
    """Detections of all frames, with the errors of a detector."""
    road_masks: Path | None
    """Folder of road masks."""
    keypoints: Path | None
    """Table of keypoints, where asked for."""
    labels: int
    """Number of labelled boxes."""


def scenarios() -> dict[str, str]:
    """Names of all scenarios, with a description."""
    return dict(_native.scenarios())


def simulate(
    scenario: str,
    out: str | os.PathLike[str],
    *,
    frames: int | None = None,
    fps: float = 10.0,
    seed: int = 1,
    width: int = 1242,
    weather: str = "clear",
    exposure_drift: float = 0.03,
    blur_samples: int = 1,
    shutter_s: float = 0.006,
    readout_ms: float = 0.0,
    depth: bool = False,
    instance: bool = False,
    keypoints: bool = False,
    force: bool = False,
    progress: _progress.ProgressArgument = None,
) -> Simulation:
    """Renders a synthetic drive with exact ground truth, as the program's `simulate` does: the same seed gives the same bytes.

    Args:
        scenario: One of `scenarios()`.
        out: Folder for the drive, new or empty; an earlier drive in it is replaced with `force`.
        frames: Frames, 12 s by default; `fps` 2 to 60 a second of the same motion.
        seed: Seed of all that is random.
        width: Width of the pictures in pixels, 16 to 8192; the view stays the same.
        weather: clear, overcast, rain, night, low-sun, tunnel or wet-mirror.
        exposure_drift: Relative amplitude of slow changes of exposure.
        blur_samples: Pictures averaged over the shutter time `shutter_s`; 1 for no motion blur.
        readout_ms: Time in which a rolling shutter reads all rows; 0 for a global one. Not with blur.
        depth, instance, keypoints: Also write depth maps, instance maps, 2D keypoints.
        progress: Function called as progress(stage, done, total), or True for bars by tqdm.

    Raises `SettingsError`, `ResourceError`; KeyboardInterrupt, after which nothing was written.
    """
    arguments = {
        "scenario": scenario,
        "out": os.fspath(out),
        "frames": round(12.0 * fps) if frames is None else frames,
        "fps": fps,
        "seed": seed,
        "width": width,
        "weather": weather,
        "exposure_drift": exposure_drift,
        "blur_samples": blur_samples,
        "shutter_s": shutter_s,
        "readout_ms": readout_ms,
        "depth": depth,
        "instance": instance,
        "keypoints": keypoints,
        "force": force,
        "command": ["python", "motorcade.simulate"],
    }
    with _progress.watched(progress) as call:
        written = _native.simulate(arguments, call)
    paths = {name: Path(path) for name, path in written.items() if name not in ("sequence", "labels") and path}
    return Simulation(
        training=paths["training"],
        sequence=written["sequence"],
        detections=paths["detections"],
        road_masks=paths.get("road_masks"),
        keypoints=paths.get("keypoints"),
        labels=written["labels"],
    )
