#!/usr/bin/env python3
"""What the physics benchmark measured, as a table for the physics page.

    cargo bench --bench physics
    python3 tests/outside/physics_speed.py
    target/release/wayhome verify physics --out results/physics

writes results/physics/speed.csv from what criterion left in target/criterion: the median time of a substep in each benchmark.
"""

import argparse
import json
import pathlib


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--criterion", default="target/criterion", type=pathlib.Path)
    parser.add_argument("--out", default="results/physics/speed.csv", type=pathlib.Path)
    args = parser.parse_args()
    rows = []
    for group in ["plant", "chassis", "rapier"]:
        for found in sorted(args.criterion.glob(f"{group}/*/new/estimates.json")):
            about = json.loads((found.parent / "benchmark.json").read_text())
            median = json.loads(found.read_text())["median"]["point_estimate"]
            rows.append(f"{about['full_id']},{median / about['throughput']['Elements']:.0f}")
    args.out.write_text("\n".join(["benchmark,ns_per_substep", *rows]) + "\n")


if __name__ == "__main__":
    main()
