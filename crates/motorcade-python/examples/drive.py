"""A drive from beginning to end: python drive.py INPUT OUT [--camera camera.toml] [--height METRES|auto] [--sequence 0005]"""

import argparse

import motorcade

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("input")
parser.add_argument("out")
parser.add_argument("--camera")
parser.add_argument("--height")
parser.add_argument("--sequence")
options = parser.parse_args()

height = options.height if options.height in (None, "auto") else float(options.height)
drive = motorcade.run(
    options.input, camera=options.camera, height_m=height, sequence=options.sequence, progress=print
)
print(drive)
for vehicle in drive.vehicles:
    length, width, tall = vehicle.size_m
    state = "moves" if vehicle.moving else "stands"
    print(f"{vehicle.class_name} {vehicle.id}: {length:.1f} × {width:.1f} × {tall:.1f} m, {len(vehicle)} frames, {state}")
drive.save(options.out)
