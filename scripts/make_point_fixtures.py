"""The named points of tests/data/points: one set of landmarks in every format and frame.

    python3 -m venv /tmp/fixtures && /tmp/fixtures/bin/pip install slicerio
    /tmp/fixtures/bin/python scripts/make_point_fixtures.py tests/data/points

The .fcsv files are written by their format's description (3D Slicer's developer guide, Markups), the .mrk.json
files from them by slicerio, of Slicer's own authors. The landmarks are no anatomy: number n lies at LPS
(10 n + 1/3, -n / 7, 100 + n / 9). A point without a meaning and one without a position go with them.
"""

import sys
from pathlib import Path

import slicerio

NAMES = [f"{name}-{side}" for name in ("ASIS", "AIIS", "FH", "SPS", "IPS", "MOF", "IOF", "GSN") for side in "lr"]
COLUMNS = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID"


def points():
    for n, name in enumerate(NAMES):
        yield name, (10 * n + 1 / 3, -n / 7, 100 + n / 9)


def fcsv(version, frame, word):
    sign = -1 if frame == "RAS" else 1
    tail = ",2,0" if version.startswith("5") else ""
    lines = [
        f"# Markups fiducial file version = {version}",
        f"# CoordinateSystem = {word}",
        f"# columns = {COLUMNS}",
    ]
    for n, (name, (x, y, z)) in enumerate(points()):
        # Every third is hidden, every fifth unselected: they are there all the same.
        flags = f"{int(n % 3 > 0)},{int(n % 5 > 0)},0"
        lines.append(f"{n},{sign * x!r},{sign * y!r},{z!r},0,0,0,1,{flags},{name},,{tail}")
    lines.append(f"{len(NAMES)},1,2,3,0,0,0,1,1,1,0,F-1,,{tail}")
    if tail:
        lines.append(f"{len(NAMES) + 1},0,0,0,0,0,0,1,1,1,0,PSIS-l,,,0,0")
    return "\n".join(lines) + "\n"


def table(frame):
    sign = -1 if frame == "ras" else 1
    lines = [f"name,x_{frame}_mm,y_{frame}_mm,z_{frame}_mm"]
    lines += [f"{name},{sign * x!r},{sign * y!r},{z!r}" for name, (x, y, z) in points()]
    return "\n".join([*lines, f"F-1,{sign},{sign * 2},3"]) + "\n"


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, version, frame, word in (
        ("slicer_4_6", "4.6", "RAS", "0"),
        ("slicer_4_8", "4.8", "RAS", "0"),
        ("slicer_4_10", "4.10", "RAS", "0"),
        ("slicer_4_11_ras", "4.11", "RAS", "RAS"),
        ("slicer_4_11_lps", "4.11", "LPS", "LPS"),
        ("slicer_4_11_number", "4.11", "LPS", "1"),
        ("slicer_5_0_lps", "5.0", "LPS", "LPS"),
        ("slicer_5_6_ras", "5.6", "RAS", "RAS"),
    ):
        path = folder / f"{name}.fcsv"
        path.write_text(fcsv(version, frame, word))
        if version in ("4.11", "4.6") and word != "1":
            slicerio.fcsv_to_markups_json(path, folder / f"{name}.mrk.json")
    for frame in ("lps", "ras"):
        (folder / f"{frame}.csv").write_text(table(frame))


main(Path(sys.argv[1]))
