"""Monocular multi-body SLAM for driving video.

One camera goes in; out come the metric trajectories of the camera and of every vehicle it sees, with covariances.

    >>> import motorcade
    >>> drive = motorcade.run("drive.mp4", camera="camera.toml", height_m=1.4)
    >>> drive.poses.shape, drive.pose_covariances.shape
    ((297, 4, 4), (297, 6, 6))
    >>> for vehicle in drive.vehicles:
    ...     print(vehicle.id, vehicle.class_name, vehicle.size_m, vehicle.p_moving)
    >>> frames, tracks = drive.to_pandas()
    >>> drive.save("runs/drive")

What is here:

- `run` takes a drive of files (video, folder of images, KITTI) from beginning to end; `load` reads a saved one back.
- `Motorcade` takes frames one by one as NumPy arrays: `step` gives the estimate of the newest frame, `finish` the drive.
- `Drive` holds the result, `Vehicle` one vehicle of it; `Estimate` and `VehicleEstimate` those of one frame.
- Detectors of your own are objects with a method `detect(image)`; see `Detector` and `Detection`.
- `tables` makes one dataset of Parquet files of many saved runs.
- `evaluate` compares a run with ground truth, `simulate` renders a drive that has it, `scenarios` names what it can render.
- `PoseGraph` and `Marginals` are the sparse pose-graph optimiser alone.
- `settings_text` prints all settings with their documentation; every function that takes `**settings` accepts a
  dictionary for each stage, such as `road={"far_heights": 12}`.

Conventions: metres, radians, seconds, pixels with centres at integer coordinates. Camera x right, y down, z forward; vehicle x
forward, y left, z up, origin on the road below its centre; the world is the camera of the first frame. Poses are homogeneous
matrices `world_from_camera` and `world_from_vehicle` ([..., 4, 4]). Covariances [..., 6, 6] are of the tangent `[ω, ν]`,
rotation first, in the frame of the body itself (`T · exp(δ)`). Results are the same for any number of threads.

Errors: `Error` is the base of `SettingsError` (arguments and settings), `InputError` (files and arrays), `ResourceError` (disk,
programs) and `GraphError`. Warnings go to the logger `motorcade`. Ctrl-C stops within a frame.
"""

# NumPy is imported by the functions that need it: it takes more time than all of this package.
from ._camera import Camera
from ._dataset import tables
from ._detector import Detection, Detector
from ._drive import Drive, Tables
from ._estimate import Estimate, VehicleEstimate
from ._evaluate import Evaluation, evaluate
from ._native import (
    Error,
    GraphError,
    InputError,
    Marginals,
    PoseGraph,
    ResourceError,
    SettingsError,
)
from ._run import load, run
from ._settings import settings_text
from ._simulate import Simulation, scenarios, simulate
from ._slam import Motorcade
from ._vehicle import Vehicle

__all__ = [
    "Camera",
    "Detection",
    "Detector",
    "Drive",
    "Error",
    "Estimate",
    "Evaluation",
    "GraphError",
    "InputError",
    "Marginals",
    "Motorcade",
    "PoseGraph",
    "ResourceError",
    "SettingsError",
    "Simulation",
    "Tables",
    "Vehicle",
    "VehicleEstimate",
    "evaluate",
    "load",
    "run",
    "scenarios",
    "settings_text",
    "simulate",
    "tables",
]
