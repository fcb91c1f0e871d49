"""Writes an HDF5 file in the full-resolution layout of the DeepFluoro data set, with h5py.

    python scripts/write_deepfluoro.py OUT                    tiny numbers: tests/data/deepfluoro.h5
    python scripts/write_deepfluoro.py OUT SPECIMEN BONES ID  a specimen's folder and the map of its
                                                              bones (NIfTI, 1 sacrum, 2 and 3 hip bones,
                                                              4 and 5 femora, left first)

Needs h5py and numpy; the second form nibabel too. Datasets are as xReg writes them: vectors are
columns, images are gzip-compressed in chunks of at most a megabyte, names are variable-length strings.
"""

import csv
import sys

import h5py
import numpy as np

# The data set's labels of our five bones.
VALUES = [0, 4, 1, 2, 5, 6]
NAMES = {1: "left-hemipelvis", 2: "right-hemipelvis", 3: "vertebrae", 4: "upper-sacrum",
         5: "left-femur", 6: "right-femur", 7: "lower-sacrum"}


def image(group, pixels, spacing, origin, directions, shuffle=False):
    """`pixels` are slices x rows x columns; spacing and origin columns, rows, slices."""
    rows = max(1, 2**20 // (pixels.itemsize * pixels.shape[1] * pixels.shape[2]))
    chunks = (min(rows, pixels.shape[0]),) + pixels.shape[1:]
    group.create_dataset("pixels", data=pixels, chunks=chunks, compression="gzip",
                         compression_opts=4, shuffle=shuffle)
    group.create_dataset("spacing", data=np.reshape(spacing, (3, 1)).astype("f8"))
    group.create_dataset("origin", data=np.reshape(origin, (3, 1)).astype("f8"))
    group.create_dataset("dir-mat", data=np.asarray(directions, "f8"))


def specimen(file, name, ct, labels, spacing, origin, directions, landmarks, names=True, shuffle=False):
    group = file.create_group(name)
    image(group.create_group("vol"), ct, spacing, origin, directions, shuffle)
    seg = group.create_group("vol-seg")
    image(seg.create_group("image"), labels, spacing, origin, directions, shuffle)
    if names:
        text = h5py.string_dtype()
        for value, label in NAMES.items():
            seg.create_dataset(f"labels-def/{value}", data=label, dtype=text)
    for key, point in landmarks.items():
        group.create_dataset(f"vol-landmarks/{key}", data=np.reshape(point, (3, 1)).astype("f8"))


def projection_parameters(file):
    group = file.create_group("proj-params")
    group.create_dataset("intrinsic", data=np.eye(3))
    group.create_dataset("num-cols", data=1536)


def tiny(path):
    """Two specimens of a few voxels: 3 columns, 4 rows, 5 slices; every voxel's value tells its place."""
    k, j, i = np.meshgrid(np.arange(5), np.arange(4), np.arange(3), indexing="ij")
    ct = 100 * k + 10 * j + i - 200
    labels = ((k * 12 + j * 3 + i) % 8).astype("u1")
    turned = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    with h5py.File(path, "w") as file:
        projection_parameters(file)
        specimen(file, "17-1882", ct.astype("f4"), labels, [1, 1, 1], [-10.5, 20.25, -900], np.eye(3),
                 {"FH-l": [93.2, 37.9, -941.5], "FH-r": [-90, 38, -940], "X-l": [1, 2, 3]})
        specimen(file, "18-1109", ct.astype("i2"), labels, [0.5, 0.75, 2], [1, 2, 3], turned,
                 {"ASIS-r": [4, 5, 6]}, names=False, shuffle=True)


def whole(path, folder, bones, name):
    import nibabel

    def lps(file):
        nifti = nibabel.load(file)
        affine = np.diag([-1.0, -1, 1, 1]) @ nifti.affine
        spacing = np.linalg.norm(affine[:3, :3], axis=0)
        return np.asarray(nifti.dataobj).T, affine[:3, 3], spacing, affine[:3, :3] / spacing

    ct, origin, spacing, directions = lps(f"{folder}/ct.nii.gz")
    labels, *_ = lps(bones)
    labels = np.asarray(VALUES, "u1")[labels]
    with open(f"{folder}/landmarks.csv") as text:
        rows = csv.DictReader(line for line in text if not line.startswith("#"))
        points = {row["name"].replace("_", "-"): [float(row[f"{a}_lps_mm"]) for a in "xyz"]
                  for row in rows}
    with h5py.File(path, "w") as file:
        projection_parameters(file)
        specimen(file, name, ct.astype("f4"), labels, spacing, origin, directions, points)


if __name__ == "__main__":
    if len(sys.argv) == 2:
        tiny(sys.argv[1])
    elif len(sys.argv) == 5:
        whole(*sys.argv[1:])
    else:
        sys.exit(__doc__)
