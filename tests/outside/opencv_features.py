#!/usr/bin/env python3
"""OpenCV's ORB, SIFT and AKAZE on the pairs of wayhome's report on vision.

    python3 -m venv .venv && .venv/bin/pip install 'opencv-python-headless==4.14.*'
    target/release/wayhome verify vision --pairs results/runs/pairs
    .venv/bin/python tests/outside/opencv_features.py results/runs/pairs
    target/release/wayhome verify vision

The first run of the report writes the panoramas, the script scores OpenCV on them and writes results/vision/opencv.csv, and
the second run shows it. Not part of CI: it needs OpenCV, and the table only changes when the panoramas do.

The rule is the report's, written anew: a match is right within 3 pixels of where the range of the home panorama puts its
feature, and if nothing hides that place. Matching is brute force with the ratio test at 0.8 and mutual nearest neighbours.
Strips are padded cyclically so that the seam is no border; features in the padding are dropped. Rows `wayhome` are
the extractor of this project with as many keypoints, through `wayhome verify vision --axis distance`.
"""

import argparse
import csv
import json
import math
import pathlib
import statistics
import subprocess
import tempfile
import time

import cv2
import numpy as np

RIGHT_PX = 3.0
PAD = 64  # columns

METHODS = {  # name: (detector, norm)
    "ORB, 500": (lambda: cv2.ORB_create(500, edgeThreshold=16), cv2.NORM_HAMMING),
    "ORB, 2000": (lambda: cv2.ORB_create(2000, edgeThreshold=16), cv2.NORM_HAMMING),
    "SIFT, 500": (lambda: cv2.SIFT_create(500), cv2.NORM_L2),
    "SIFT, all": (lambda: cv2.SIFT_create(), cv2.NORM_L2),
    "AKAZE": (lambda: cv2.AKAZE_create(), cv2.NORM_HAMMING),
}
OURS = [500, 1000, 2000]  # keypoints


class Shot:
    def __init__(self, folder, record):
        name = record["name"]
        self.distance = record["distance_m"]
        self.pose = [record["pose"][k] for k in ("x_m", "y_m", "heading_rad")]
        self.grey = cv2.cvtColor(cv2.imread(str(folder / f"{name}-rgb.png")), cv2.COLOR_BGR2GRAY)
        self.range = cv2.imread(str(folder / f"{name}-range.png"), cv2.IMREAD_UNCHANGED) / 1000.0
        p = record["projection"]
        self.height, self.width = self.grey.shape
        self.pixel, self.horizon, self.mount = 2 * math.pi / p["width"], p["horizon_row"] - 0.5, p["mount_rad"]

    def ranges(self, x, y):
        rows = np.clip(np.rint(y).astype(int), 0, self.height - 1)
        return self.range[rows, np.rint(x).astype(int) % self.width]

    def appearance(self, now, x, y):
        """Where what is seen here at (x, y) must appear in `now`, and whether it can be seen."""
        tan = (self.horizon - y) * self.pixel
        flat = self.ranges(x, y) / np.sqrt(1 + tan * tan)
        azimuth = x * self.pixel + self.mount + self.pose[2]
        dx, dy = self.pose[0] + flat * np.cos(azimuth) - now.pose[0], self.pose[1] + flat * np.sin(azimuth) - now.pose[1]
        flat_now = np.hypot(dx, dy)
        there_x = (np.arctan2(dy, dx) - now.pose[2] - now.mount) / now.pixel % now.width
        there_y = now.horizon - flat * tan / flat_now / now.pixel
        expected = np.hypot(flat_now, flat * tan)
        near = [abs(now.ranges(there_x + i, there_y + j) - expected) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        visible = (np.min(near, axis=0) < 0.02 + 0.02 * expected) & (there_y >= -0.5) & (there_y <= now.height - 0.5)
        return there_x, there_y, visible


def extract(detector, grey):
    strip = np.hstack([grey[:, -PAD:], grey, grey[:, :PAD]])
    keypoints, descriptors = detector.detectAndCompute(strip, None)
    places = np.array([k.pt for k in keypoints]).reshape(-1, 2) - [PAD, 0]
    inside = (places[:, 0] >= 0) & (places[:, 0] < grey.shape[1])
    return places[inside], None if descriptors is None else descriptors[inside]


def match(norm, now, home):
    if now is None or home is None or len(home) < 2 or not len(now):
        return np.zeros((0, 2), int)
    matcher = cv2.BFMatcher(norm)
    back = {m.queryIdx: m.trainIdx for m in matcher.match(home, now)}
    pairs = [p for p in matcher.knnMatch(now, home, 2) if len(p) == 2 and p[0].distance < 0.8 * p[1].distance]
    return np.array([(p[0].trainIdx, p[0].queryIdx) for p in pairs if back[p[0].trainIdx] == p[0].queryIdx], int).reshape(-1, 2)


def right(home, now, from_places, to_places):
    x, y, visible = home.appearance(now, from_places[:, 0], from_places[:, 1])
    dx = (to_places[:, 0] - x + now.width / 2) % now.width - now.width / 2
    return int((visible & (np.hypot(dx, to_places[:, 1] - y) <= RIGHT_PX)).sum())


def opencv(world, home, shots):
    for name, (create, norm) in METHODS.items():
        detector = create()
        home_places, home_descriptors = extract(detector, home.grey)
        for distance in sorted({s.distance for s in shots}):
            matches, good, extracting, matching = [], [], [], []
            for now in (s for s in shots if s.distance == distance):
                start = time.process_time()
                places, descriptors = extract(detector, now.grey)
                middle = time.process_time()
                found = match(norm, descriptors, home_descriptors)
                extracting.append(1e3 * (middle - start))
                matching.append(1e3 * (time.process_time() - middle))
                matches.append(len(found))
                good.append(right(home, now, home_places[found[:, 0]], places[found[:, 1]]))
            yield [world, distance, name, len(home_places), len(matches), statistics.mean(matches), statistics.mean(good),
                   statistics.median(extracting), statistics.median(matching)]


def wayhome(binary, worlds):
    for keypoints in OURS:
        with tempfile.TemporaryDirectory() as out:
            command = [binary, "verify", "vision", *worlds, "--axis", "distance", "--keypoints", str(keypoints), "--out", out,
                       "--threads", "1", "--json"]
            study = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        for cell in study["cells"]:
            yield [cell["world"], cell["level"], f"wayhome, {keypoints}", keypoints, cell["panoramas"], cell["matches"],
                   cell["right"], study["observe_ms"], 0.0]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pairs", type=pathlib.Path, help="folder that `wayhome verify vision --pairs` has written")
    parser.add_argument("--wayhome", default="target/release/wayhome")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("results/vision/opencv.csv"))
    args = parser.parse_args()
    cv2.setNumThreads(1)
    records = json.loads((args.pairs / "pairs.json").read_text())
    worlds = list(dict.fromkeys(r["world"] for r in records))
    rows = list(wayhome(args.wayhome, worlds))
    for world in worlds:
        home, *shots = [Shot(args.pairs, r) for r in records if r["world"] == world]
        rows += opencv(world, home, shots)
    with args.out.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow("world,distance_m,method,keypoints,panoramas,matches,right,extract_ms,match_ms".split(","))
        writer.writerows([w, f"{d:g}", f'{m.replace(", ", " ")}', k, n, *(f"{v:.2f}" for v in rest)] for w, d, m, k, n, *rest in rows)


if __name__ == "__main__":
    main()
