"""Drives of files: from beginning to end, and read back."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from . import _arguments, _drive, _native, _progress, _settings
from ._arguments import PathArgument
from ._camera import Camera, CameraArgument, camera_of
from ._detector import Detector, adapted
from ._drive import Drive


def run(
    input: PathArgument,
    *,
    camera: CameraArgument | int | None = None,
    height_m: float | Literal["auto"] | None = None,
    sequence: str | None = None,
    frames: str | tuple[int | None, int | None] | None = None,
    stride: int = 1,
    fps: float | None = None,
    format: str | None = None,
    calibration: PathArgument | None = None,
    ignore: PathArgument | None = None,
    models: PathArgument | None = None,
    detector: Detector | None = None,
    detections: PathArgument | None = None,
    road_masks: PathArgument | None = None,
    trajectory: PathArgument | None = None,
    trajectory_scale: Literal["unknown", "metric"] = "unknown",
    speed: PathArgument | None = None,
    gps: PathArgument | None = None,
    clock_offset: float | tuple[float, float] | None = None,
    vehicle_poses: PathArgument | Sequence[PathArgument] = (),
    keypoints: PathArgument | None = None,
    shape_prior: PathArgument | None = None,
    map: PathArgument | None = None,
    online: bool = False,
    preset: str = "default",
    config: PathArgument | None = None,
    seed: int | None = None,
    threads: int = 0,
    keep_perception: bool = False,
    progress: _progress.ProgressArgument = None,
    **settings: Any,
) -> Drive:
    """Estimates a drive of files: the camera and every vehicle it sees.

    Args:
        input: Video file (read through the program ffmpeg), folder of images, KITTI tracking split, odometry or raw folder.
        camera: Intrinsics: a `Camera`, a dictionary of its fields, a calibration file (see `Camera.read`); or the number of a
            camera of a KITTI rig, whose input has its own calibration.
        height_m: Height of the camera above the road [m], all lengths are proportional to it; "auto" estimates it by the sizes
            of the cars that are seen. KITTI input and some calibration files know their own.
        sequence: Sequence of a KITTI tracking split, such as "0005".
        frames: Frames to take by the input's own numbers: (first, end) without end, or "16..101".
        stride: Takes every n-th of them.
        fps: Frames per second, where the input does not say.
        format: kitti-tracking, kitti-odometry, kitti-raw, tum, images or video, where looking at the input is not enough.
        calibration: Calibration file beside `camera` as a number of a rig.
        ignore: Mask, or folder of masks by frame number, of pixels to ignore (not zero).
        models: Folder of ONNX networks, or "none"; the networks inside the package by default.
        detector: Detector of vehicles of your own in place of the network; see `Detector`.
        detections: File of detections in place of the network: KITTI labels, MOT Challenge, or frame,x1,y1,x2,y2,score.
        road_masks: Folder of road masks by frame number in place of the network.
        trajectory: Camera trajectory (TUM or KITTI) in place of odometry, in the unit `trajectory_scale`.
        speed: Speeds of the car beside the height: CSV with columns time, speed_mps (or speed_kmh, speed_mph), optionally sigma_mps.
        gps: GPS track of the drive (.gpx, .nmea, or .csv with columns time, latitude, longitude), in place of `speed`.
        clock_offset: From the clock of the frames to that of `speed` or `gps` [s], or with its standard deviation.
        vehicle_poses: Files of vehicle poses in place of own localisation.
        keypoints, shape_prior: File of keypoints of vehicles, and the prior of the shapes they belong to.
        map: Places of an earlier drive through the same streets, as `motorcade run --save-map` wrote them: where they are seen again,
            the drive is estimated in the world of that one.
        online: Every frame is estimated from it and the frames before it alone, and stays so.
        preset: "default" or "paper".
        config: Settings of a TOML file or of the run.json of an earlier run.
        seed: Seed of all random choices.
        threads: 0 takes all cores; results do not depend on it.
        keep_perception: `Drive.save` also writes what perception saw (perception.jsonl).
        progress: Function called as progress(stage, done, total), or True for bars by tqdm.
        settings: A dictionary for each stage, such as road={"far_heights": 12}; `settings_text` lists them.

    Returns:
        The drive. `Drive.save` writes the same files as the program `motorcade run` with the same input and settings.

    Raises:
        SettingsError, InputError, ResourceError; KeyboardInterrupt within a frame; what `detector` and `progress` raise.

    Networks of a folder run in this process without the trial run that the program makes first.
    """
    if detector is not None and detections is not None:
        raise _native.SettingsError("give either detector or detections, not both")
    if isinstance(vehicle_poses, (str, os.PathLike)):
        vehicle_poses = [vehicle_poses]
    if online and not (speed is None and gps is None):
        raise _native.SettingsError("speed and gps are used at the end of a drive only, not with online=True")
    if map is not None and (online or trajectory is not None):
        raise _native.SettingsError("map is met by a drive's own odometry at its end: not with online=True, not with trajectory")
    if trajectory_scale not in ("unknown", "metric"):
        raise _native.SettingsError("trajectory_scale must be 'unknown' or 'metric'")
    rig, described = _arguments.rig(camera), None
    if camera is not None and rig is None:
        described = camera_of(camera) if isinstance(camera, (Camera, Mapping)) else None
        if calibration is not None:
            raise _native.SettingsError("give either camera or calibration, not both")
        calibration = None if described is not None else _arguments.path(camera)
    arguments: dict[str, Any] = {
        "input": _arguments.path(input),
        "format": format,
        "sequence": sequence,
        "camera": rig,
        "fps": fps,
        "frames": _arguments.frame_range(frames),
        "stride": _arguments.whole("stride", stride, 1),
        "ignore": _arguments.path(ignore),
        "height_m": None if height_m == "auto" else _arguments.number("height_m", height_m),
        "height_auto": height_m == "auto",
        "models": _arguments.path(models),
        "detections": _arguments.path(detections),
        "road_masks": _arguments.path(road_masks),
        "trajectory": _arguments.path(trajectory),
        "metric": trajectory_scale == "metric",
        "speed": _arguments.path(speed),
        "gps": _arguments.path(gps),
        "clock_offset": _arguments.clock(clock_offset),
        "vehicle_poses": [_arguments.path(path) for path in vehicle_poses],
        "keypoints": _arguments.path(keypoints),
        "shape_prior": _arguments.path(shape_prior),
        "map": _arguments.path(map),
        "keep_perception": keep_perception,
        "threads": _arguments.whole("threads", threads, 0),
        "settings": _settings.arguments(preset, config, online, seed, settings),
    }
    with tempfile.TemporaryDirectory(prefix="motorcade-") as folder, _progress.watched(progress) as call:
        arguments["calibration"] = _arguments.path(calibration)
        arguments["command"] = _arguments.command(arguments, preset, config, online, seed, settings)
        if described is not None:
            # Not part of the command: it is gone after the run.
            file = Path(folder) / "camera.toml"
            file.write_text(described.to_toml(), encoding="utf-8")
            arguments["calibration"] = os.fspath(file)
        native = _native.run(arguments, adapted(detector), call)
    return _drive.from_native(native)


def load(directory: PathArgument) -> Drive:
    """Reads a saved run back: of `Drive.save` or of the program.

    Numbers of tables have the digits of the files; of the covariances of vehicles the files hold four variances a state.
    Raises `InputError` for a directory that holds no run.
    """
    path = Path(directory)
    read = _native.read_run(os.fspath(path))
    try:
        record = json.loads((path / "run.json").read_text(encoding="utf-8"))
        tables = ((path / "frames.csv").read_bytes(), (path / "tracks.csv").read_bytes())
    except (OSError, ValueError) as error:
        raise _native.InputError(f"{path}: is no run: {error}") from error
    given = record.get("input") or {}
    facts = {
        "intrinsics_px": given.get("intrinsics_px"),
        "size_px": (given.get("width"), given.get("height")),
        "height_m": record.get("camera_height_m"),
        "length_m": float(record.get("length_m") or 0.0),
        "warnings": record.get("warnings") or [],
    }
    return Drive(read["camera"], read["vehicles"], facts, tables, None, path)
