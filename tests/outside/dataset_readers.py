"""Reads a set of layout `webdataset` with PyPI's webdataset and pyarrow and prints what they see, for tests/dataset.rs to compare.

usage: dataset_readers.py FOLDER
"""

import glob
import json
import os
import sys

import numpy
import pyarrow.parquet
import webdataset


def checksum(pixels):
    """Sum of values times their number from 1, modulo a prime."""
    total, prime = 0, 1_000_000_007
    for number, value in enumerate(pixels.reshape(-1).tolist(), 1):
        total = (total + value * number) % prime
    return total


def samples(folder):
    shards = sorted(glob.glob(os.path.join(folder, "shards", "*.tar")))
    found = {}
    # "pil" leaves 16-bit pictures as they are.
    for sample in webdataset.WebDataset(shards, shardshuffle=False).decode("pil"):
        rgb, depth, instance = (numpy.asarray(sample[name]) for name in ("rgb.png", "range.png", "instance.png"))
        assert rgb.dtype == numpy.uint8 and rgb.shape[2] == 3, rgb.dtype
        assert sample["rgb.png"].mode == "RGB" and sample["range.png"].mode.startswith("I"), sample["range.png"].mode
        assert rgb.shape[:2] == depth.shape == instance.shape
        found[sample["__key__"]] = {
            "size": [rgb.shape[1], rgb.shape[0]],
            "rgb": checksum(rgb),
            "range": checksum(depth),
            "instance": checksum(instance),
            "x_m": sample["json"]["pose"]["x_m"],
        }
    return found


def weigh(column):
    """The sum of a column: of numbers and truths as they are, of texts their lengths; empty cells count nothing."""
    values = [value for value in column.to_pylist() if value is not None]
    return float(sum(len(value.encode()) if isinstance(value, str) else value for value in values))


def table(folder, name):
    parts = sorted(glob.glob(os.path.join(folder, "truth", f"{name}-*.parquet")))
    whole = pyarrow.concat_tables([pyarrow.parquet.read_table(part) for part in parts])
    return {"rows": whole.num_rows, "columns": {c: weigh(whole[c]) for c in whole.column_names}}


def main():
    folder = sys.argv[1]
    told = {name: table(folder, name) for name in ("frames", "landmarks", "matches")}
    told["samples"] = samples(folder)
    json.dump(told, sys.stdout)


if __name__ == "__main__":
    main()
