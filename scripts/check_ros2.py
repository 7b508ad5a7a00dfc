"""Reads a recording with ROS 2's messages without ROS, and compares it with the tables of its run.

    python scripts/check_ros2.py RUN FILE.mcap

Every message is read twice: by the definitions in the file (mcap-ros2-support), and by those of ROS 2 Humble that the package rosbags
brings. Both have the same fields. rosbags also opens the file as a bag.
"""

import csv
import dataclasses
import pathlib
import sys
import tempfile

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
SPEEDS = ("speed_mps", "sigma_speed_mps", "distance_m", "time_gap_s")


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def matrix(x, y, z, w):
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def same(one, other, name):
    """Two decoded messages have the same content."""
    if dataclasses.is_dataclass(other):
        # Constants of the definition are fields of the class too.
        for field, _ in STORE.fielddefs[other.__msgtype__][1]:
            same(getattr(one, field), getattr(other, field), f"{name}.{field}")
    elif isinstance(other, (list, tuple)) and other and dataclasses.is_dataclass(other[0]):
        assert len(one) == len(other), name
        for a, b in zip(one, other):
            same(a, b, name)
    elif isinstance(other, (list, tuple, np.ndarray)):
        assert np.array_equal(np.frombuffer(one, np.uint8) if isinstance(one, bytes) else np.asarray(one), other), name
    else:
        assert one == other, (name, one, other)


def read(file):
    """Topics with log times and messages, and the types of the topics."""
    topics, types = {}, {}
    with open(file, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            types[channel.topic] = schema.name
            same(decoded, STORE.deserialize_cdr(message.data, schema.name), channel.topic)
            topics.setdefault(channel.topic, []).append((message.log_time, decoded))
            # ROS pads as it writes, and reads nothing behind the last field.
            again = STORE.serialize_cdr(STORE.deserialize_cdr(message.data, schema.name), schema.name)
            assert bytes(again).rstrip(b"\0") == message.data.rstrip(b"\0"), channel.topic
            for name, fields in get_types_from_msg(schema.data.decode(), schema.name).items():
                assert fields == STORE.fielddefs[name], name
    return topics, types


def check_camera(run, topics, frames):
    poses = [[float(x) for x in line.split()] for line in (run / "ego.tum").read_text().splitlines() if line[:1] != "#"]
    covariances = [[float(x) for x in row.values()][1:] for row in table(run / "ego_covariance.csv")]
    places = [(row, column) for row in range(6) for column in range(row, 6)]
    for (time, found), (_, tf), wanted, values in zip(topics["/camera/pose"], topics["/tf"], poses, covariances):
        stamp = found.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == time and abs(time * 1e-9 - wanted[0]) < 1e-6
        at, moved = found.pose.pose.position, tf.transforms[1].transform.translation
        np.testing.assert_allclose([at.x, at.y, at.z], wanted[1:4], atol=1e-9)
        assert (moved.x, moved.y, moved.z) == (at.x, at.y, at.z)
        own = np.zeros((6, 6))
        for (row, column), value in zip(places, values):
            own[row, column] = own[column, row] = value
        q = found.pose.pose.orientation
        turn = matrix(q.x, q.y, q.z, q.w)
        # Position first, about the axes of the world; ours is rotation first, in the camera.
        expected = np.block([[turn @ own[3:, 3:] @ turn.T, turn @ own[3:, :3] @ turn.T],
                             [turn @ own[:3, 3:] @ turn.T, turn @ own[:3, :3] @ turn.T]])  # fmt: skip
        np.testing.assert_allclose(np.reshape(found.pose.covariance, (6, 6)), expected, rtol=1e-6, atol=1e-15)
    # `map` has z up: forward, left, up of the first camera.
    q = topics["/tf"][0][1].transforms[0].transform.rotation
    np.testing.assert_allclose(matrix(q.x, q.y, q.z, q.w), [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], atol=1e-12)
    for _, info in topics["/camera/camera_info"]:
        assert info.width > 0 and info.k[0] == info.p[0] > 0 and list(info.d) == [0.0] * 5
    assert all(bytes(image.data[:2]) == b"\xff\xd8" and image.format == "jpeg" for _, image in topics["/camera/image/compressed"])
    assert len(topics["/camera/path"]) == 1 and len(topics["/camera/path"][0][1].poses) == len(frames)


def check_vehicles(run, topics, frames):
    vehicles = {}
    for row in table(run / "tracks.csv"):
        vehicles.setdefault(row["frame"], {})[int(row["id"])] = row
    cubes = 0
    for row, (_, array) in zip(frames, topics["/vehicles"]):
        wanted = vehicles.get(row["frame"], {})
        assert array.markers[0].action == 3 and all(marker.action == 0 for marker in array.markers[1:])
        found = {marker.id: marker for marker in array.markers if marker.ns == "body"}
        assert found.keys() == wanted.keys()
        for id, marker in found.items():
            expected = wanted[id]
            assert marker.type == 1 and abs(marker.scale.x - float(expected["length_m"])) < 1e-6
            at = marker.pose.position
            apart = sum((value - float(expected[f"{axis}_m"])) ** 2 for value, axis in zip((at.x, at.y, at.z), "xyz")) ** 0.5
            assert abs(apart - 0.5 * float(expected["height_m"])) < 1e-5
            cubes += 1
        labels = [marker.text for marker in array.markers if marker.ns == "label"]
        assert len(labels) == len(found) and all(labels)
    return cubes


def open_as_bag(file, counts):
    """rosbags' reader of bags, with the metadata that `ros2 bag reindex` would write."""
    from rosbags.rosbag2 import Reader

    with tempfile.TemporaryDirectory() as folder:
        bag = pathlib.Path(folder) / "bag"
        bag.mkdir()
        (bag / file.name).write_bytes(file.read_bytes())
        (bag / "metadata.yaml").write_text(metadata(file.name, counts))
        with Reader(bag) as reader:
            assert {c.topic: c.msgcount for c in reader.connections} == {t: n for t, (_, n) in counts.items()}
            assert sum(1 for _ in reader.messages()) == sum(n for _, n in counts.values())


def metadata(name, counts):
    lines = ["rosbag2_bagfile_information:", "  version: 5", "  storage_identifier: mcap", "  duration: {nanoseconds: 0}"]
    lines += ["  starting_time: {nanoseconds_since_epoch: 0}", f"  message_count: {sum(n for _, n in counts.values())}"]
    lines += ["  topics_with_message_count:"]
    for topic, (kind, count) in counts.items():
        meta = f'{{name: "{topic}", type: {kind}, serialization_format: cdr, offered_qos_profiles: ""}}'
        lines.append(f"    - {{topic_metadata: {meta}, message_count: {count}}}")
    lines += ['  compression_format: ""', '  compression_mode: ""', "  relative_file_paths:", f"    - {name}"]
    file = f"path: {name}, starting_time: {{nanoseconds_since_epoch: 0}}, duration: {{nanoseconds: 0}}, message_count: 0"
    return "\n".join([*lines, "  files:", f"    - {{{file}}}"]) + "\n"


def main():
    run, file = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    frames, speeds = table(run / "frames.csv"), table(run / "speeds.csv")
    topics, types = read(file)
    for topic in ("/camera/pose", "/camera/camera_info", "/tf", "/vehicles"):
        assert len(topics[topic]) == len(frames), topic
    assert 0 < len(topics["/camera/image/compressed"]) <= len(frames)
    check_camera(run, topics, frames)
    cubes = check_vehicles(run, topics, frames)
    for name in SPEEDS:
        wanted = [float(row[name]) for row in speeds if row[name]]
        assert [message.data for _, message in topics.get(f"/speeds/{name}", [])] == wanted, name
    open_as_bag(file, {topic: (types[topic], len(found)) for topic, found in topics.items()})
    print(f"{file.name}: {len(frames)} frames, {cubes} markers of vehicles, {len(topics)} topics, read as a ROS 2 bag")


main()
