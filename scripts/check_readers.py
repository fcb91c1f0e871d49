"""Compares volumes as the program reads them with SimpleITK: size, every corner's LPS position, and the voxels by a checksum.

    python3 -m venv /tmp/check && /tmp/check/bin/pip install SimpleITK numpy
    cargo run --release --example volume_summary -- ../shared/data/pelvic_labels/*/*.mhd tests/data/volumes/oblique_*.n*r* > results/volumes.jsonl
    /tmp/check/bin/python scripts/check_readers.py results/volumes.jsonl

Fails when a size or a checksum differs, or a corner lies more than 1e-3 mm off (NIfTI headers have 32-bit floats).
"""

import itertools
import json
import sys
import zlib

import numpy as np
import SimpleITK as sitk

failed = False
lines = open(sys.argv[1]).read().splitlines()
for line in lines:
    ours = json.loads(line)
    theirs = sitk.ReadImage(ours["file"])
    problems = []
    if list(theirs.GetSize()) != ours["dims"]:
        problems.append(f"size {ours['dims']}, SimpleITK {theirs.GetSize()}")
    affine = np.array(ours["lps_from_index"])
    apart = 0.0
    for corner in itertools.product(*[(0, n - 1) for n in theirs.GetSize()]):
        there = np.array(theirs.TransformIndexToPhysicalPoint(corner))
        apart = max(apart, np.linalg.norm(affine @ [*corner, 1] - there))
    if apart > 1e-3:
        problems.append(f"a corner lies {apart:.3g} mm off")
    voxels = sitk.GetArrayFromImage(theirs)
    if zlib.crc32(voxels.astype("<i2").tobytes()) != ours["crc32_of_i16"]:
        problems.append("voxels differ")
    failed |= bool(problems)
    print(f"{ours['file']}: {', '.join(problems) or f'equal, corners within {apart:.1e} mm'}")
if not lines:
    sys.exit("no volumes were given")
sys.exit("a volume differs" if failed else 0)
