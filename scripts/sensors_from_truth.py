#!/usr/bin/env python3
"""Makes what a car's bus and a GPS receiver would have recorded of a KITTI drive, from its ground truth, to judge `run --speed` and `--gps`.

    scripts/sensors_from_truth.py POSES.txt OUT [--seed 1]

Writes OUT/speed.csv (10 Hz, 1 % too high, noise of 0.05 m/s, whole km/h) and OUT/gps.csv (1 Hz, errors of 2 m that last for a minute and of 0.5 m that
do not, antenna 1 m behind the camera). Both clocks are 0.4 s ahead. Standard library only.
"""
import argparse
import math
import pathlib
import random

RATE, CLOCK_S, TOO_HIGH, ANTENNA_M = 10, 0.4, 1.01, 1.0
EARTH_M, LATITUDE, LONGITUDE = 6378137.0, 49.0, 8.4

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("poses", type=pathlib.Path)
parser.add_argument("out", type=pathlib.Path)
parser.add_argument("--seed", default=1, type=int)
options = parser.parse_args()
draw = random.Random(options.seed)
rows = [[float(v) for v in line.split()] for line in options.poses.read_text().splitlines()]
places = [row[3::4] for row in rows]
options.out.mkdir(parents=True, exist_ok=True)

with open(options.out / "speed.csv", "w") as file:
    file.write("time,speed_kmh\n")
    for k in range(1, len(places) - 1):
        speed = TOO_HIGH * math.dist(places[k - 1], places[k + 1]) * RATE / 2 + draw.gauss(0, 0.05)
        file.write(f"{k / RATE + CLOCK_S:.2f},{3.6 * speed:.0f}\n")

lasting = [draw.gauss(0, 2), draw.gauss(0, 2)]
with open(options.out / "gps.csv", "w") as file:
    file.write("time,latitude,longitude,sigma_m\n")
    for k in range(0, len(places), RATE):
        lasting = [error * math.exp(-1 / 60) + draw.gauss(0, 2 * math.sqrt(1 - math.exp(-2 / 60))) for error in lasting]
        east, north = (places[k][a] - ANTENNA_M * rows[k][4 * a + 2] + e + draw.gauss(0, 0.5) for a, e in zip((0, 2), lasting))
        latitude = LATITUDE + math.degrees(north / EARTH_M)
        longitude = LONGITUDE + math.degrees(east / EARTH_M / math.cos(math.radians(LATITUDE)))
        file.write(f"{k / RATE + CLOCK_S:.2f},{latitude:.9f},{longitude:.9f},2.0\n")
