"""Loads a condition's folder of an `image-folder` set with Hugging Face's datasets and prints what it sees, for tests/dataset.rs to compare.

usage: image_folder.py FOLDER
"""

import json
import sys

import datasets
import numpy

from dataset_readers import checksum


def main():
    datasets.disable_progress_bars()
    samples = datasets.load_dataset("imagefolder", data_dir=sys.argv[1], split="train", streaming=True)
    told = []
    for sample in samples:
        rgb = numpy.asarray(sample.pop("image"))
        told.append({**sample, "size": [rgb.shape[1], rgb.shape[0]], "rgb": checksum(rgb)})
    json.dump(told, sys.stdout)


if __name__ == "__main__":
    main()
