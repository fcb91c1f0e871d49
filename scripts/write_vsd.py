"""Writes a subject's folder in the layout of VSDFullBodyBoneReconstruction, with pynrrd.

    python scripts/write_vsd.py OUT                    a few voxels: tests/data/vsd
    python scripts/write_vsd.py OUT SPECIMEN BONES ID  a specimen's folder and the map of its bones
                                                       (NIfTI, 1 sacrum, 2 and 3 hip bones, 4 and 5
                                                       femora, left first)

Needs pynrrd and numpy; the second form nibabel too. The first form writes the segmentation twice: as one
label map, and in one layer a segment, as Slicer did before version 4.11.
"""

import json
import os
import sys

import nrrd
import numpy as np

NAMES = ["Sacrum", "Hip_L", "Hip_R", "Femur_L", "Femur_R"]


def place(origin, columns, layers=False):
    directions = np.asarray(columns, float).T
    if layers:
        directions = np.vstack([[np.nan] * 3, directions])
    kinds = (["list"] if layers else []) + ["domain"] * 3
    return {"space": "left-posterior-superior", "space directions": directions,
            "space origin": np.asarray(origin, float), "kinds": kinds, "encoding": "gzip"}


def segmentation(path, structures, origin, columns, layers):
    """`structures` by i, j, k: 0 or 1 + the number in NAMES. A segment that is no bone of ours is added."""
    header = place(origin, columns, layers)
    names = ["Patella_R"] + NAMES
    for n, name in enumerate(names):
        header[f"Segment{n}_ID"] = f"Segment_{n + 1}"
        header[f"Segment{n}_Name"] = name
        header[f"Segment{n}_Extent"] = "0 1 0 1 0 1"
        if not layers:
            header[f"Segment{n}_LabelValue"] = str(n + 1)
            header[f"Segment{n}_Layer"] = "0"
    label = np.where(structures > 0, structures + 1, 0).astype("u1")
    if layers:
        # Fortran order: the layer is the fastest index.
        label = np.stack([(label == n + 1) for n in range(len(names))]).astype("u1")
    nrrd.write(path, label, header, index_order="F")


def subject(folder, scan, stem, ct, structures, origin, columns, sex):
    inner = os.path.join(folder, scan)
    os.makedirs(inner)
    nrrd.write(f"{inner}/{stem}.nrrd", ct.astype("i2"), place(origin, columns), index_order="F")
    segmentation(f"{inner}/{stem}_Reconstruction.seg.nrrd", structures, origin, columns, False)
    with open(f"{inner}/{scan}.json", "w") as text:
        json.dump({"subjectSnapshot": {"gender": {"name": sex}, "ageInDays": 27740}}, text)
    return inner


def tiny(folder):
    """3 x 4 x 5 voxels on oblique axes; every voxel's value tells its place."""
    i, j, k = np.meshgrid(np.arange(3), np.arange(4), np.arange(5), indexing="ij")
    ct = 100 * k + 10 * j + i - 200
    structures = (k * 12 + j * 3 + i) % 6
    c, s = 0.8, 0.6
    columns = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) * [0.5, 0.75, 2]
    inner = subject(folder, "SMIR.Body.076Y.M.CT.1", "SMIR.Pelvis-Thighs", ct, structures, [10, -20, 30],
                    columns, "Male")
    segmentation(f"{inner}/layers.seg.nrrd", structures, [10, -20, 30], columns, True)


def whole(folder, specimen, bones, name):
    import nibabel

    def lps(file):
        nifti = nibabel.load(file)
        return np.asarray(nifti.dataobj), np.diag([-1.0, -1, 1, 1]) @ nifti.affine

    ct, affine = lps(f"{specimen}/ct.nii.gz")
    structures, _ = lps(bones)
    subject(folder, f"SMIR.{name}", f"SMIR.{name}.Pelvis-Thighs", ct, structures, affine[:3, 3],
            affine[:3, :3], "unknown")


if __name__ == "__main__":
    if len(sys.argv) == 2:
        tiny(sys.argv[1])
    elif len(sys.argv) == 5:
        whole(*sys.argv[1:])
    else:
        sys.exit(__doc__)
