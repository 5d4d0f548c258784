"""The visual compass of `wayhome evaluate SET --methods ridf --homes 1` against navipy's rotational image difference.

    python3 navipy_ridf.py SET/CONDITION EVALUATED

SET/CONDITION is a condition's folder of a set of layout `folder` (N.rgb.png, columns anti-clockwise) whose robot looks one way at all places, so
that the true turn is 0 and the table's error is the turn. EVALUATED holds `pairs.csv`. The least of navipy's differences must lie at the
column that the turn rounds to. Wants navipy, numpy and pillow.
"""

import csv
import pathlib
import sys

import numpy as np
from navipy.comparing import rot_imagediff
from PIL import Image


def view(folder, key):
    """Grey, by ITU-R BT.601, as the program has it."""
    rgb = np.asarray(Image.open(folder / f"{key}.rgb.png").convert("RGB")).astype(int)
    grey = (299 * rgb[..., 0] + 587 * rgb[..., 1] + 114 * rgb[..., 2] + 500) // 1000
    # Four channels, as of a bee, and one view.
    return np.repeat(grey.astype(float)[:, :, None, None], 4, axis=2) / 255.0


def main():
    folder, evaluated = map(pathlib.Path, sys.argv[1:])
    same = near = count = 0
    for row in csv.DictReader(open(evaluated / "pairs.csv")):
        if row["method"] != "ridf":
            continue
        home, now = view(folder, row["home"]), view(folder, row["now"])
        difference = np.asarray(rot_imagediff(now, home))[:, 0]
        width = len(difference)
        # It turns the current view the other way round.
        column = (-int(np.argmin(difference))) % width
        turn = float(row["turn_error_deg"]) / 360.0 * width
        off = abs((turn - column + width / 2) % width - width / 2)
        same += off <= 0.5 + 1e-9
        count += 1
    print(f"{same} of {count} turns are navipy's")
    sys.exit(same != count)


if __name__ == "__main__":
    main()
