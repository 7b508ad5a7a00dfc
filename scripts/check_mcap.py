"""Reads a recording with the Python packages of MCAP and compares it with the tables of its run.

    python scripts/check_mcap.py RUN FILE.mcap [rerun]

Needs mcap and mcap-protobuf-support. With `rerun` the file is also loaded by rerun's own importer (rerun-sdk).
"""

import csv
import json
import pathlib
import sys

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def close(a, b, tolerance=1e-6):
    assert abs(a - b) <= tolerance * max(1.0, abs(b)), (a, b)


def main():
    run, file = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    poses = [[float(x) for x in line.split()] for line in (run / "ego.tum").read_text().splitlines() if line[:1] != "#"]
    frames, tracks = table(run / "frames.csv"), table(run / "tracks.csv")
    vehicles = {}
    for row in tracks:
        vehicles.setdefault(row["frame"], {})[row["id"]] = row
    messages, text = {}, []
    with open(file, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for schema, channel, message in reader.iter_messages():
            if channel.message_encoding == "json":
                text.append((message.log_time, json.loads(message.data)))
        stream.seek(0)
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages(topics=[
            "/camera/image", "/camera/calibration", "/camera/annotations", "/camera/pose", "/camera/path", "/tf", "/vehicles"
        ]):
            messages.setdefault(channel.topic, []).append((message.log_time, decoded))
    counts = {topic: len(found) for topic, found in messages.items()}
    for topic in ["/camera/calibration", "/camera/annotations", "/camera/pose", "/tf", "/vehicles"]:
        assert counts[topic] == len(frames), (topic, counts[topic], len(frames))
    assert counts["/camera/path"] == 1 and len(messages["/camera/path"][0][1].poses) == len(frames)
    assert 0 < counts["/camera/image"] <= len(frames) and len(text) == len(frames)
    assert all(image.data[:2] == b"\xff\xd8" for _, image in messages["/camera/image"])
    for (time, found), (_, tf), expected in zip(messages["/camera/pose"], messages["/tf"], poses):
        assert abs(time * 1e-9 - expected[0]) < 1e-6
        for at in (found.pose.position, tf.transforms[1].translation):
            for value, wanted in zip((at.x, at.y, at.z), expected[1:4]):
                close(value, wanted)
        assert [t.child_frame_id for t in tf.transforms] == ["world", "camera"]
    cubes = 0
    for row, (_, scene) in zip(frames, messages["/vehicles"]):
        wanted = vehicles.get(row["frame"], {})
        assert {entity.id for entity in scene.entities} == set(wanted)
        for entity in scene.entities:
            cube, expected = entity.cubes[0], wanted[entity.id]
            close(cube.size.x, float(expected["length_m"]))
            close(cube.size.z, float(expected["height_m"]))
            # The middle of the body: half its height from the road.
            apart = sum(
                (getattr(cube.pose.position, axis) - float(expected[f"{axis}_m"])) ** 2 for axis in "xyz"
            ) ** 0.5
            close(apart, 0.5 * float(expected["height_m"]), 1e-5)
            cubes += 1
    for (_, row), expected in zip(text, table(run / "speeds.csv")):
        close(row["speed_mps"], float(expected["speed_mps"]))
    if sys.argv[3:] == ["rerun"]:
        by_rerun(file, len(frames))
    print(f"{file.name}: {len(frames)} frames, {cubes} cuboids, {file.stat().st_size / len(frames):.0f} bytes a frame")


def by_rerun(file, frames):
    """rerun's own importer of MCAP."""
    import subprocess
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out.rrd"
        subprocess.run([sys.executable, "-m", "rerun", "mcap", "convert", str(file), "-o", str(out)], check=True)
        assert out.stat().st_size > frames * 1000, "rerun kept less than the pictures"
        told = subprocess.run(
            [sys.executable, "-m", "rerun", "rrd", "print", str(out)], check=True, capture_output=True, text=True
        ).stdout
        for entity in ("/camera/image", "/vehicles", "/camera/pose"):
            assert entity in told, f"rerun does not know {entity}"


main()
