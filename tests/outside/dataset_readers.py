"""Reads a set of layout `webdataset` with PyPI's webdataset and pyarrow and prints what they see, for tests/dataset.rs to compare.

usage: dataset_readers.py FOLDER
"""

import glob
import io
import json
import os
import sys

import numpy
import PIL.Image
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
    # Without a name of a picture decoder, pictures stay bytes; those of webdataset would make 8 bits of 16.
    for sample in webdataset.WebDataset(shards, shardshuffle=False).decode():
        pictures = [PIL.Image.open(io.BytesIO(sample[name])) for name in ("rgb.png", "range.png", "instance.png")]
        assert [picture.mode[0] for picture in pictures] == ["R", "I", "I"], [picture.mode for picture in pictures]
        rgb, depth, instance = (numpy.asarray(picture) for picture in pictures)
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
