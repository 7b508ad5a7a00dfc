"""Frames in memory, one by one: python frames.py FOLDER_OF_PICTURES FOCAL_LENGTH_PX CAMERA_HEIGHT_M FRAMES_PER_SECOND"""

import pathlib
import sys

import numpy
from PIL import Image

import motorcade

folder, focal_px, height_m, fps = pathlib.Path(sys.argv[1]), *map(float, sys.argv[2:])
slam = None
for k, path in enumerate(sorted(folder.glob("*.png"))):
    image = numpy.array(Image.open(path).convert("RGB"))
    height, width = image.shape[:2]
    if slam is None:
        camera = motorcade.Camera(focal_px, focal_px, (width - 1) / 2, (height - 1) / 2, width, height)
        slam = motorcade.Motorcade(camera, height_m)
    now = slam.step(image, time_ns=round(k / fps * 1e9))
    nearest = min((now.camera_from_vehicle(v)[2, 3] for v in now.vehicles), default=float("nan"))
    print(f"{now.time_s:6.2f} s  {now.speed_mps:5.1f} m/s  {len(now.vehicles)} vehicles, nearest {nearest:.1f} m")
if slam is not None:
    print(slam.finish())
