"""A small rendered drive, and the program to compare with."""

import os
import pathlib
import shutil

import numpy
import pytest
from PIL import Image

import motorcade

REPOSITORY = pathlib.Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def simulation(tmp_path_factory):
    """24 frames of the scenario `demo`, 400 px wide."""
    out = tmp_path_factory.mktemp("simulation") / "drive"
    return motorcade.simulate("demo", out, frames=24, width=400, seed=3)


@pytest.fixture(scope="session")
def arguments(simulation):
    """Arguments of `run` on that drive with the simulation's own boxes and road. What is fixed to the camera is not looked for: in
    so short a drive the road's texture passes for a bonnet."""
    return {
        "input": simulation.training,
        "sequence": simulation.sequence,
        "models": "none",
        "detections": simulation.detections,
        "road_masks": simulation.road_masks,
        "run": {"fixed_regions": False},
    }


@pytest.fixture(scope="session")
def drive(arguments):
    return motorcade.run(**arguments)


@pytest.fixture(scope="session")
def saved(drive, tmp_path_factory):
    directory = tmp_path_factory.mktemp("saved") / "run"
    drive.save(directory)
    return directory


@pytest.fixture(scope="session")
def frames(simulation):
    """Pictures and times [ns] of the drive."""
    png = sorted((simulation.training / "image_02" / simulation.sequence).glob("*.png"))
    pictures = [numpy.array(Image.open(path).convert("RGB")) for path in png]
    calibration = motorcade.Camera.read(simulation.training / "calib" / f"{simulation.sequence}.txt", camera=2)
    height, width = pictures[0].shape[:2]
    camera = motorcade.Camera(calibration.fx, calibration.fy, calibration.cx, calibration.cy, width, height)
    return camera, [(k * 100_000_000, picture) for k, picture in enumerate(pictures)]


@pytest.fixture(scope="session")
def program():
    """The program `motorcade` of the same sources."""
    path = os.environ.get("MOTORCADE_PROGRAM") or shutil.which("motorcade")
    if path is None:
        candidates = [REPOSITORY / "target" / profile / "motorcade" for profile in ("release", "debug")]
        path = next((str(candidate) for candidate in candidates if candidate.exists()), None)
    if path is None:
        pytest.skip("the program is not built; MOTORCADE_PROGRAM names it")
    return path
