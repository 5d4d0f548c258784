#!/usr/bin/env python3
"""Opens a recording with the readers of MCAP's makers and holds it against the run's own files.

    wayhome home lab --seed 3 --record run.mcap --out run
    python tests/outside/check_recording.py run.mcap run

Fails on the first thing that is not as it should be, else prints the topics with their schemas and numbers of messages.
"""

import collections
import csv
import json
import math
import pathlib
import struct
import sys

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

SCHEMAS = {
    "/tf": "foxglove.FrameTransforms",
    "/room": "foxglove.SceneUpdate",
    "/home/bearings": "foxglove.SceneUpdate",
    "/truth": "foxglove.PoseInFrame",
    "/odometry": "foxglove.Odometry",
    "/estimate": "foxglove.Odometry",
    "/estimate/pose": "foxglove.PoseInFrame",
    "/estimate/ellipse": "foxglove.SceneUpdate",
    "/bearings": "foxglove.SceneUpdate",
    "/command": "wayhome.Command",
    "/diagnostics": "wayhome.Diagnostics",
    "/log": "foxglove.Log",
    "/panorama": "foxglove.CompressedImage",
    "/home/panorama": "foxglove.CompressedImage",
}


def near(found, wanted, what):
    assert abs(found - wanted) < 1e-9, f"{what}: found {found}, expected {wanted}"


def heading(q):
    return math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))


def compose(a, b):
    x, y, h = a
    return (x + math.cos(h) * b[0] - math.sin(h) * b[1], y + math.sin(h) * b[0] + math.cos(h) * b[1], h + b[2])


def place(transform):
    t = transform.translation
    return (t.x, t.y, heading(transform.rotation))


def turned(a, b):
    return abs(math.remainder(a - b, math.tau))


def size_of_jpeg(data):
    at = 2
    while True:
        marker, length = struct.unpack(">HH", data[at : at + 4])
        if 0xFFC0 <= marker <= 0xFFC3:
            return struct.unpack(">HH", data[at + 5 : at + 9])[::-1]
        at += 2 + length


def main(recording, folder):
    with open(folder / "trajectory.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    summary = json.loads((folder / "summary.json").read_text())
    kept = collections.defaultdict(list)
    times = []
    with open(recording, "rb") as file:
        reader = make_reader(file)
        assert reader.get_header().library == "wayhome"
        statistics = reader.get_summary().statistics
        for schema, channel, message, decoded in decoded_messages(reader):
            assert SCHEMAS[channel.topic] == schema.name, (channel.topic, schema.name)
            assert message.log_time == message.publish_time
            times.append(message.log_time)
            kept[channel.topic].append((message.log_time / 1e9, decoded))
        notes = [note.metadata for note in reader.iter_metadata()]
    assert times == sorted(times), "times go back"
    assert statistics.message_count == len(times)
    assert notes[0]["seed"] == str(summary["seed"]) and notes[0]["world_sha256"] == summary["world_sha256"]

    seen = [row for row in rows if row["matched"]]
    believed = [row for row in rows if row["range_est_m"]]
    for topic in ("/truth", "/odometry", "/command", "/diagnostics"):
        assert len(kept[topic]) == len(rows), (topic, len(kept[topic]), len(rows))
    assert len(kept["/tf"]) == len(rows) + 1 and len(kept["/bearings"]) == len(seen)
    assert len(kept["/estimate"]) == len(kept["/estimate/pose"]) == len(believed)
    assert [m.message for _, m in kept["/log"]][-1].startswith(summary["outcome"])

    fixed = {t.child_frame_id: t for t in kept["/tf"][0][1].transforms}
    assert fixed["home"].parent_frame_id == "map" and fixed["camera"].translation.z > 0
    for row, (time, truth), (_, tf), (_, command), (_, facts) in zip(
        rows, kept["/truth"], kept["/tf"][1:], kept["/command"], kept["/diagnostics"]
    ):
        near(time, float(row["t_s"]), "time")
        near(truth.pose.position.x, float(row["x_m"]), "x")
        near(truth.pose.position.y, float(row["y_m"]), "y")
        assert truth.frame_id == "map" and turned(heading(truth.pose.orientation), float(row["heading_rad"])) < 1e-9
        near(command["v_m_s"], float(row["v_cmd"]), "command")
        near(facts["slip_left_m_s"], float(row["slip_left"]), "slip")
        # From the room by way of odometry to where the robot truly is.
        chain = {t.child_frame_id: t for t in tf.transforms}
        assert chain["odom"].parent_frame_id == "map" and chain["base_link"].parent_frame_id == "odom"
        robot = compose(place(chain["odom"]), place(chain["base_link"]))
        near(robot[0], float(row["x_m"]), "chain x")
        near(robot[1], float(row["y_m"]), "chain y")
        assert turned(robot[2], float(row["heading_rad"])) < 1e-9
    for row, (_, estimate) in zip(believed, kept["/estimate"]):
        position = estimate.pose.position
        near(math.hypot(position.x, position.y), float(row["range_est_m"]), "range")
        assert estimate.frame_id == "home" and len(estimate.pose_covariance) == 36
        near(math.sqrt(estimate.pose_covariance[35]), float(row["heading_sd_rad"]), "sd of the heading")
    for row, (_, scene) in zip(seen, kept["/bearings"]):
        lines = sum(len(line.points) // 2 for entity in scene.entities for line in entity.lines)
        assert lines >= int(row["matched"]) + int(row["rejected"]), "each bearing is a line"
    bodies = [e for e in kept["/room"][0][1].entities if e.triangles or e.cylinders]
    assert len(bodies) > 3

    pictures = kept.get("/panorama", [])
    if summary["setup"]["size_px"]:
        assert len(pictures) == len(seen) and len(kept["/home/panorama"]) == 1
        for _, picture in pictures:
            assert picture.format == "jpeg" and list(size_of_jpeg(picture.data)) == summary["setup"]["size_px"]
    else:
        assert not pictures
    for topic in sorted(kept):
        print(f"{topic} {SCHEMAS[topic]} {len(kept[topic])}")


def decoded_messages(reader):
    """Messages in the order in which they lie in the file: protobuf by their schemas, JSON as it is."""
    factory = DecoderFactory()
    decoders = {}
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        if channel.message_encoding == "json":
            yield schema, channel, message, json.loads(message.data)
            continue
        if channel.id not in decoders:
            decoders[channel.id] = factory.decoder_for(channel.message_encoding, schema)
        yield schema, channel, message, decoders[channel.id](message.data)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
