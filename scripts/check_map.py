"""A GPS track made of a run, and a check of the files that `motorcade export` writes from both.

    python scripts/check_map.py track RUN TRACK.csv          a fix a second with 1.5 m of noise, every 12th 40 m away; TRACK.gpx and
                                                             TRACK.nmea beside it have the same fixes
    python scripts/check_map.py check RUN MAP SCHEMA.xsd     place, heading and clock; every file read with other software

Needs numpy, gpxpy and lxml.
"""

import csv
import datetime
import functools
import json
import math
import operator
import pathlib
import sys

import numpy as np

LATITUDE, LONGITUDE, HEADING_DEG, CLOCK_S, SIGMA_M = 47.3769, 8.5417, 217.0, 1.7e9 + 12.34, 1.5
# Metres a degree at that latitude (WGS 84: meridian and prime vertical radii of curvature).
A, E2 = 6378137.0, 0.0066943799901
W = math.sqrt(1 - E2 * math.sin(math.radians(LATITUDE)) ** 2)
NORTH_M = math.radians(1) * A * (1 - E2) / W**3
EAST_M = math.radians(1) * A / W * math.cos(math.radians(LATITUDE))


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def camera(run):
    """Times [s] and positions east, north [m] of the camera. The world's y axis is taken for down: a few centimetres."""
    rows = np.loadtxt(run / "ego.tum", comments="#")
    turn = math.radians(HEADING_DEG)
    right, ahead = rows[:, 1] - rows[0, 1], rows[:, 3] - rows[0, 3]
    east = right * math.cos(turn) + ahead * math.sin(turn)
    north = -right * math.sin(turn) + ahead * math.cos(turn)
    return rows[:, 0], np.stack([east, north], axis=1)


def degrees(local):
    return LATITUDE + local[1] / NORTH_M, LONGITUDE + local[0] / EAST_M


def track(run, path):
    times, way = camera(run)
    random = np.random.default_rng(7)
    lines, fixes = ["time,latitude,longitude,sigma_m"], []
    for k, time in enumerate(np.arange(times[0] + 0.37, times[-1], 1.0)):
        at = [np.interp(time, times, way[:, axis]) for axis in (0, 1)] + random.normal(0, SIGMA_M, 2)
        at[0] += 40.0 if k % 12 == 5 else 0.0
        latitude, longitude = degrees(at)
        lines.append(f"{time + CLOCK_S:.3f},{latitude:.9f},{longitude:.9f},{SIGMA_M}")
        fixes.append((datetime.datetime.fromtimestamp(time + CLOCK_S, datetime.timezone.utc), latitude, longitude))
    path.write_text("\n".join(lines) + "\n")
    points = [f'<trkpt lat="{a:.9f}" lon="{b:.9f}"><time>{t:%Y-%m-%dT%H:%M:%S.%f}Z</time></trkpt>' for t, a, b in fixes]
    gpx = ['<gpx version="1.1" creator="check" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>', *points]
    path.with_suffix(".gpx").write_text("\n".join([*gpx, "</trkseg></trk></gpx>"]) + "\n")
    path.with_suffix(".nmea").write_text("".join(map(rmc, fixes)))


def rmc(fix):
    """A sentence RMC: degrees and minutes in one number."""
    time, latitude, longitude = fix
    lat, lon = (f"{int(value):0{digits}d}{60 * (value % 1):09.6f}" for value, digits in ((latitude, 2), (longitude, 3)))
    body = f"GPRMC,{time:%H%M%S}.{time.microsecond // 1000:03d},A,{lat},N,{lon},E,0.0,0.0,{time:%d%m%y},,,A"
    return f"${body}*{functools.reduce(operator.xor, body.encode()):02X}\r\n"


def within(name, value, expected, sigma):
    print(f"{name}: {value - expected:+.3f} from the truth, standard deviation {sigma:.3f}")
    assert abs(value - expected) < 3 * sigma, name


def check(run, folder, schema):
    import gpxpy
    from lxml import etree

    start = json.loads((folder / "export.json").read_text())["start"]
    apart = math.hypot((start["latitude_deg"] - LATITUDE) * NORTH_M, (start["longitude_deg"] - LONGITUDE) * EAST_M)
    # The demo is a bend at nearly constant speed: its clock is told by --clock-offset alone.
    within("start [m]", apart, 0.0, start["sigma_position_m"])
    within("heading [deg]", start["heading_deg"], HEADING_DEG, start["sigma_heading_deg"])
    within("clock [s]", start["clock_offset_s"], CLOCK_S, start["sigma_clock_offset_s"])

    frames, tracks = table(run / "frames.csv"), table(run / "tracks.csv")
    vehicles = {row["id"] for row in tracks}

    tree = etree.XMLSchema(etree.parse(str(schema)))
    scenario = etree.parse(str(folder / "drive.xosc"))
    tree.assertValid(scenario)
    assert len(scenario.findall(".//ScenarioObject")) == len(vehicles) + 1
    vertices = len(scenario.findall(".//Vertex"))
    single = sum(sum(row["id"] == v for row in tracks) == 1 for v in vehicles)
    assert vertices == len(frames) + len(tracks) - single, (vertices, len(frames), len(tracks), single)
    print(f"drive.xosc: valid, {len(vehicles) + 1} vehicles, {vertices} vertices")

    gpx = gpxpy.parse((folder / "drive.gpx").read_text())
    assert len(gpx.tracks) == len(vehicles) + 1 and len(gpx.tracks[0].segments[0].points) == len(frames)
    times, way = camera(run)
    point = gpx.tracks[0].segments[0].points[-1]
    assert abs(point.time.timestamp() - (times[-1] + start["clock_offset_s"])) < 2e-3
    length = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
    assert abs(gpx.tracks[0].length_2d() / length - 1) < 0.005, (gpx.tracks[0].length_2d(), length)
    print(f"drive.gpx: {len(gpx.tracks)} tracks, the camera's {gpx.tracks[0].length_2d():.1f} m of {length:.1f} m")

    features = json.loads((folder / "drive.geojson").read_text())["features"]
    assert len(features) == len(vehicles) + 1
    for feature in features:
        line, properties = feature["geometry"]["coordinates"], feature["properties"]
        line = [line] if feature["geometry"]["type"] == "Point" else line
        assert len(line) == len(properties["seconds"]) == len(properties["times"]) == len(properties["sigma_m"])
    kml = etree.parse(str(folder / "drive.kml"))
    assert len(kml.findall(".//{http://www.opengis.net/kml/2.2}Placemark")) == len(vehicles) + 1
    oxts = np.loadtxt(folder / "ego.oxts.csv")
    assert oxts.shape == (len(frames), 30)
    turned = math.degrees(math.pi / 2 - oxts[0, 5]) - HEADING_DEG
    assert abs((turned + 180) % 360 - 180) < 2 * start["sigma_heading_deg"] + 1.0, turned
    print("drive.geojson, drive.kml, ego.oxts.csv: read")


def main():
    run, place = pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    if sys.argv[1] == "track":
        track(run, place)
    else:
        check(run, place, pathlib.Path(sys.argv[4]))


if __name__ == "__main__":
    main()
