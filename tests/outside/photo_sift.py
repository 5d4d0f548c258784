"""OpenCV's SIFT with a ratio test on the pairs of `wayhome evaluate PANOS`, as a Markdown table.

    python3 photo_sift.py PANOS [COLUMNS]

PANOS holds equirectangular pictures and `poses.csv` (file, x_m, y_m, heading_deg, room). Pictures are made COLUMNS wide (720) and cut at 45
degrees above and below the horizon, as the program does. A match is right if it is seen within 2 degrees of the half plane that the line of
sight from home and the step from home span. Wants opencv-python-headless and numpy.
"""

import csv
import math
import pathlib
import sys

import cv2
import numpy as np

TOLERANCE_RAD = math.radians(2.0)
RATIO = 0.8


def rays(points, width, horizon, heading):
    """Unit vectors in the room; columns run clockwise."""
    azimuth = heading - points[:, 0] * 2 * math.pi / width
    elevation = (horizon - 0.5 - points[:, 1]) * 2 * math.pi / width
    flat = np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=1)


def misses(home, now, step):
    """Angle of each ray of now to the half plane of home's ray and the step."""
    normal = np.cross(np.broadcast_to(step, home.shape), home)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.maximum(length, 1e-12)
    off = np.sum(now * normal, axis=1)
    foot = now - normal * off[:, None]
    foot /= np.maximum(np.linalg.norm(foot, axis=1, keepdims=True), 1e-12)
    along = np.arctan2(np.sum(np.cross(np.broadcast_to(step, foot.shape), foot) * normal, axis=1), foot @ step)
    inside = along >= np.arccos(np.clip(home @ step, -1, 1))
    between = lambda a, b: np.arccos(np.clip(np.sum(a * b, axis=1), -1, 1))
    ends = np.minimum(between(home, now), between(np.broadcast_to(-step, now.shape), now))
    return np.where(inside, np.abs(np.arcsin(np.clip(off, -1, 1))), ends)


def main():
    folder = pathlib.Path(sys.argv[1])
    width = int(sys.argv[2]) if len(sys.argv) > 2 else 720
    sift = cv2.SIFT_create(nfeatures=500)
    views = []
    for row in csv.DictReader(open(folder / "poses.csv")):
        picture = cv2.imread(str(folder / row["file"]), cv2.IMREAD_GRAYSCALE)
        picture = cv2.resize(picture, (width, width // 2), interpolation=cv2.INTER_AREA)[width // 8 : 3 * width // 8]
        keypoints, descriptors = sift.detectAndCompute(picture, None)
        points = np.array([k.pt for k in keypoints])
        heading = math.radians(float(row["heading_deg"]))
        place = np.array([float(row["x_m"]), float(row["y_m"])])
        views.append((row["room"], place, rays(points, width, width / 8, heading), descriptors))
    matcher = cv2.BFMatcher()
    kinds = ["room, to 1 m", "room, to 2.5 m", "room, to 5 m", "rooms, to 5 m", "rooms, beyond 5 m"]
    sums = {kind: [0, 0, 0] for kind in kinds}
    for home in views:
        for now in views:
            distance = float(np.linalg.norm(now[1] - home[1]))
            same = home[0] == now[0]
            if now is home or (same and distance > 5.0):
                continue
            bounds = [1.0, 2.5, 5.0] if same else [5.0, math.inf]
            kind = kinds[(0 if same else 3) + next(k for k, bound in enumerate(bounds) if distance <= bound)]
            best = matcher.knnMatch(home[3], now[3], k=2)
            good = [pair[0] for pair in best if len(pair) == 2 and pair[0].distance < RATIO * pair[1].distance]
            step = np.append((now[1] - home[1]) / distance, 0.0)
            right = 0
            if good:
                off = misses(home[2][[m.queryIdx for m in good]], now[2][[m.trainIdx for m in good]], step)
                right = int(np.sum(off <= TOLERANCE_RAD))
            for k, value in enumerate([1, len(good), right]):
                sums[kind][k] += value
    print("| OpenCV SIFT, ratio 0.8 | pairs | matches | right |")
    print("|---|---:|---:|---:|")
    for kind in kinds:
        pairs, matches, right = sums[kind]
        print(f"| {kind} | {pairs} | {matches} | {right} ({100 * right / max(matches, 1):.1f} %) |")


if __name__ == "__main__":
    main()
