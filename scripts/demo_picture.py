#!/usr/bin/env python3
"""Draws docs/demo.png: a frame of the demo with the estimated vehicles in it, and the map of the drive below.

    cargo run --release -- demo
    scripts/demo_picture.py runs/demo --frame 26 --out docs/demo.png

Needs Pillow (`pip install pillow`).
"""

import argparse
import csv
import math
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

WIDTH = 1100
# Lines are drawn this many times larger and then shrunk.
FINE = 3
MOVING, PARKED, CAMERA, TRUTH = (196, 62, 40), (30, 110, 190), (20, 90, 60), (60, 60, 60)


def rotation(qx, qy, qz, qw):
    return [
        [1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qz * qw), 2 * (qx * qz + qy * qw)],
        [2 * (qx * qy + qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qx * qw)],
        [2 * (qx * qz - qy * qw), 2 * (qy * qz + qx * qw), 1 - 2 * (qx * qx + qy * qy)],
    ]


def moved(pose, p):
    r, t = pose
    return [sum(r[i][k] * p[k] for k in range(3)) + t[i] for i in range(3)]


def inverse(pose):
    r, t = pose
    back = [[r[k][i] for k in range(3)] for i in range(3)]
    return back, [-sum(back[i][k] * t[k] for k in range(3)) for i in range(3)]


def read_tum(path):
    rows = [[float(v) for v in line.split()] for line in path.read_text().splitlines() if line.strip()]
    return [(rotation(*row[4:8]), row[1:4]) for row in rows]


def read_kitti(path):
    rows = [[float(v) for v in line.split()] for line in path.read_text().splitlines() if line.strip()]
    return [([row[0:3], row[4:7], row[8:11]], [row[3], row[7], row[11]]) for row in rows]


def read_tracks(path):
    """Frame → list of vehicles."""
    frames = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            number = {k: float(v) for k, v in row.items() if k not in ("class", "source")}
            pose = rotation(*(number[k] for k in ("qx", "qy", "qz", "qw"))), [number[k] for k in ("x_m", "y_m", "z_m")]
            size = [number[k] for k in ("length_m", "width_m", "height_m")]
            frames.setdefault(int(number["frame"]), []).append(
                {"id": int(number["id"]), "pose": pose, "size": size, "speed": number["speed_mps"], "moving": number["p_moving"] > 0.5}
            )
    return frames


def true_ways(training, world_from_camera):
    """Places of every labelled vehicle in the world, by track."""
    ways = {}
    for line in (training / "label_02" / "0000.txt").read_text().splitlines():
        fields = line.split()
        frame, track = int(fields[0]), int(fields[1])
        if track >= 0:
            ways.setdefault(track, []).append(moved(world_from_camera[frame], [float(v) for v in fields[13:16]]))
    return ways


def draw_frame(image, camera, world_from_camera, tracks, frame, font):
    fx, cx, fy, cy = camera
    scale = FINE * WIDTH / image.width
    image = image.resize((round(image.width * scale), round(image.height * scale)), Image.BICUBIC)
    draw = ImageDraw.Draw(image)
    camera_from_world = inverse(world_from_camera[frame])

    def pixel(point):
        x, y, z = moved(camera_from_world, point)
        return None if z < 0.5 else (scale * (fx * x / z + cx + 0.5), scale * (fy * y / z + cy + 0.5))

    def line(a, b, colour, width):
        a, b = pixel(a), pixel(b)
        if a and b:
            draw.line([a, b], fill=colour, width=width)

    def away(vehicle):
        return moved(camera_from_world, vehicle["pose"][1])[2]

    for vehicle in sorted(tracks.get(frame, []), key=away, reverse=True):
        colour = MOVING if vehicle["moving"] else PARKED
        length, width, height = vehicle["size"]
        corners = [
            moved(vehicle["pose"], [sx * length / 2, sy * width / 2, sz * height])
            for sz in (0, 1) for sx, sy in ((1, 1), (1, -1), (-1, -1), (-1, 1))
        ]
        for i in range(4):
            line(corners[i], corners[(i + 1) % 4], colour, 2 * FINE)
            line(corners[4 + i], corners[4 + (i + 1) % 4], colour, 2 * FINE)
            line(corners[i], corners[4 + i], colour, 2 * FINE)
        if vehicle["moving"]:
            # Where it will be within a second and a half.
            later = [v["pose"][1] for f in range(frame, frame + 16) for v in tracks.get(f, []) if v["id"] == vehicle["id"]]
            for a, b in zip(later, later[1:]):
                line(a, b, colour, 3 * FINE)
        top = [p for p in map(pixel, corners[4:]) if p]
        if top:
            text = f"{vehicle['id']}: {vehicle['speed']:.1f} m/s" if vehicle["moving"] else f"{vehicle['id']}: parked"
            x, y = sum(p[0] for p in top) / len(top), min(p[1] for p in top) - 4 * FINE
            box = draw.textbbox((x, y), text, font=font, anchor="ms")
            draw.rectangle([box[0] - 8, box[1] - 5, box[2] + 8, box[3] + 5], fill=(255, 255, 255))
            draw.text((x, y), text, font=font, fill=colour, anchor="ms")
    return image


def draw_map(estimate, truth, tracks, ways, frame, font, height):
    image = Image.new("RGB", (FINE * WIDTH, FINE * height), (255, 255, 255))
    draw = ImageDraw.Draw(image)
    last = {v["id"]: v for f in sorted(tracks) for v in tracks[f]}
    all_points = [p[1] for p in estimate] + [v["pose"][1] for f in tracks.values() for v in f]
    low = [min(p[k] for p in all_points) for k in (0, 2)]
    high = [max(p[k] for p in all_points) for k in (0, 2)]
    margin = 26
    scale = FINE * min((WIDTH - 2 * margin) / (high[1] - low[1] + 8), (height - 3 * margin) / (high[0] - low[0] + 8))

    def place(p):
        # Forward to the right, left up.
        return FINE * margin + scale * (p[2] - low[1] + 4), FINE * (2 * margin) + scale * (p[0] - low[0] + 4)

    def way(points, colour, width, dashed=False):
        places = [place(p) for p in points]
        for i, (a, b) in enumerate(zip(places, places[1:])):
            if not dashed or i % 4 < 2:
                draw.line([a, b], fill=colour, width=width)

    for points in [[p[1] for p in truth], *ways.values()]:
        way(points, TRUTH, FINE, dashed=True)
    for number, vehicle in last.items():
        points = [v["pose"][1] for f in sorted(tracks) for v in tracks[f] if v["id"] == number]
        colour = MOVING if vehicle["moving"] else PARKED
        if vehicle["moving"]:
            way(points, colour, 2 * FINE)
        length, width, _ = vehicle["size"]
        outline = [
            place(moved(vehicle["pose"], [sx * length / 2, sy * width / 2, 0]))
            for sx, sy in ((1, 1), (1, -1), (-1, -1), (-1, 1))
        ]
        draw.polygon(outline, outline=colour, fill=tuple(255 - (255 - c) // 3 for c in colour), width=FINE)
        x, y = place(vehicle["pose"][1])
        draw.text((x, y - 11 * FINE), str(number), font=font, fill=colour, anchor="ms")
    way([p[1] for p in estimate], CAMERA, 3 * FINE)
    x, y = place(estimate[frame][1])
    draw.ellipse([x - 5 * FINE, y - 5 * FINE, x + 5 * FINE, y + 5 * FINE], fill=CAMERA)

    # Legend and scale.
    x, y = FINE * margin, FINE * margin
    for colour, text in ((CAMERA, "camera; the dot: the frame above"), (MOVING, "moving vehicles"), (PARKED, "parked vehicles"), (TRUTH, "ground truth (dashed)")):
        draw.line([x, y, x + 26 * FINE, y], fill=colour, width=3 * FINE if colour != TRUTH else FINE)
        draw.text((x + 32 * FINE, y), text, font=font, fill=(40, 40, 40), anchor="lm")
        x += 32 * FINE + draw.textlength(text, font=font) + 22 * FINE
    ten = 10 * scale
    right, bottom = FINE * (WIDTH - margin), FINE * (height - margin)
    draw.line([right - ten, bottom, right, bottom], fill=(40, 40, 40), width=2 * FINE)
    draw.text((right - ten / 2, bottom - 5 * FINE), "10 m", font=font, fill=(40, 40, 40), anchor="ms")
    return image


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, help="results of `motorcade demo`; the drive lies beside them")
    parser.add_argument("--frame", type=int, default=26)
    parser.add_argument("--out", type=Path, default=Path("docs/demo.png"))
    parser.add_argument("--most-kb", type=int, default=400)
    options = parser.parse_args()

    training = options.run.with_name(options.run.name + "-drive") / "training"
    projection = next(l for l in (training / "calib" / "0000.txt").read_text().splitlines() if l.startswith("P2"))
    numbers = [float(v) for v in projection.split()[1:]]
    camera = numbers[0], numbers[2], numbers[5], numbers[6]
    estimate, truth = read_tum(options.run / "ego.tum"), read_kitti(training / "gt_poses" / "0000.txt")
    tracks, ways = read_tracks(options.run / "tracks.csv"), true_ways(training, truth)
    font = ImageFont.load_default(13 * FINE)

    frame = Image.open(training / "image_02" / "0000" / f"{options.frame:06d}.png").convert("RGB")
    upper = draw_frame(frame, camera, estimate, tracks, options.frame, font)
    lower = draw_map(estimate, truth, tracks, ways, options.frame, font, 460)
    both = Image.new("RGB", (upper.width, upper.height + lower.height))
    both.paste(upper, (0, 0))
    both.paste(lower, (0, upper.height))
    both = both.resize((WIDTH, round(both.height / FINE)), Image.LANCZOS)
    for colours in (256, 160, 96, 64):
        both.quantize(colours, dither=Image.Dither.NONE).save(options.out, optimize=True)
        if options.out.stat().st_size < 1000 * options.most_kb:
            break
    print(f"{options.out}: {options.out.stat().st_size // 1000} kB, {colours} colours")


if __name__ == "__main__":
    main()
