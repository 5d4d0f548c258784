"""Table of poses of a tour of the Zillow Indoor Dataset (ZInD), for `wayhome evaluate PANOS`.

    python3 zind_poses.py TOUR > TOUR/panos/poses.csv

TOUR holds `zind_data.json` and `panos/`. In the plan's frame azimuth grows with the column of a picture, and column u of W looks at
2 pi u / W - pi / 2 plus the picture's rotation; y is mirrored here so that angles run anti-clockwise seen from above. The room is the complete
room, whose parts one sees from one another. Nothing but Python's own library is needed.
"""

import csv
import json
import pathlib
import sys


def rows(tour):
    data = json.loads((tour / "zind_data.json").read_text())
    for floor, rooms in data["merger"].items():
        scale_m = data["scale_meters_per_coordinate"][floor]
        for room, parts in rooms.items():
            for part in parts.values():
                for panorama in part.values():
                    plan = panorama["floor_plan_transformation"]
                    x, y = plan["translation"]
                    heading_deg = (90.0 - plan["rotation"]) % 360.0
                    name = pathlib.PurePosixPath(panorama["image_path"]).name
                    yield [name, round(x * scale_m, 4), round(-y * scale_m, 4), round(heading_deg, 3), f"{floor} {room}"]


if __name__ == "__main__":
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["file", "x_m", "y_m", "heading_deg", "room"])
    table.writerows(sorted(rows(pathlib.Path(sys.argv[1]))))
