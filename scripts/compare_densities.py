"""Bone by depth below its surface: specimens with assigned Hounsfield values beside a real CT.

    python3 -m venv /tmp/check && /tmp/check/bin/pip install numpy scipy nibabel pydicom
    /tmp/check/bin/python scripts/compare_densities.py ../shared/data/vhm_ct results/z001 results/z013 ...

The real CT is the folder of the Visible Human Male's 32 slices, 1 mm apart, from 12 mm below the femoral heads'
tops to 19 mm above. Of each specimen's folder the same slab is taken. Both are treated alike: bone is what exceeds
200 HU more than 45 mm from the midline, closed by one voxel and filled slice by slice, in pieces of 3 cm^3 or
more; depth is the distance of a voxel to the nearest one outside.
"""

import glob
import sys

import nibabel
import numpy
import pydicom
from scipy import ndimage

THRESHOLD_HU = 200
MIDLINE_MM = 45
LEAST_VOXELS = 3000
BELOW_MM, ABOVE_MM = 12, 19
# The rows in front of these hold the hands, which lie on the belly.
HANDS_END = 180
PERCENTILES = [5, 25, 50, 75, 95]


def real(folder):
    """HU (z, y, x), 1 mm."""
    slices = [pydicom.dcmread(file) for file in glob.glob(f"{folder}/*.dcm")]
    slices.sort(key=lambda s: float(s.ImagePositionPatient[2]))
    hu = [s.pixel_array * float(s.RescaleSlope) + float(s.RescaleIntercept) for s in slices]
    hu = numpy.stack(hu)
    hu[:, :HANDS_END] = -1000
    return hu


def assigned(folder):
    """HU (z, y, x), 1 mm, of the slab about the tops of the femoral heads."""
    load = lambda name: numpy.asarray(nibabel.as_closest_canonical(nibabel.load(f"{folder}/{name}")).dataobj)
    hu, labels = load("ct.nii.gz").T.astype(float), load("labels.nii.gz").T
    tops = [numpy.where((labels == femur).any((1, 2)))[0].max() for femur in (2, 3)]
    top = sum(tops) // 2
    return hu[top - BELOW_MM : top + ABOVE_MM + 1]


def depths(hu):
    """Depth (mm) of every voxel of bone, 0 elsewhere."""
    bone = hu > THRESHOLD_HU
    columns = numpy.where(bone.any((0, 1)))[0]
    middle = (columns[0] + columns[-1]) / 2
    bone[:, :, numpy.abs(numpy.arange(bone.shape[2]) - middle) <= MIDLINE_MM] = False
    pieces, _ = ndimage.label(bone)
    counts = numpy.bincount(pieces.ravel())
    counts[0] = 0
    bone = counts[pieces] > LEAST_VOXELS
    for k in range(len(bone)):
        bone[k] = ndimage.binary_fill_holes(ndimage.binary_closing(bone[k]))
    # Beyond the slab the bone goes on.
    return ndimage.distance_transform_edt(numpy.pad(bone, ((30, 30), (0, 0), (0, 0)), mode="edge"))[30:-30]


def rows(hu):
    depth = depths(hu)
    for low in range(0, 16):
        values = hu[(depth > low) & (depth <= low + 1)]
        if len(values) > 200:
            yield low, len(values), numpy.percentile(values, PERCENTILES), values.mean(), values.std()


if __name__ == "__main__":
    print(f"{'':14}{'depth mm':>9}{'voxels':>8}{'mean':>7}{'SD':>6}" + "".join(f"{p:>6}%" for p in PERCENTILES))
    for folder, read in [(sys.argv[1], real)] + [(folder, assigned) for folder in sys.argv[2:]]:
        hu = read(folder)
        name = folder.rstrip("/").split("/")[-1]
        for low, count, percentiles, mean, sd in rows(hu):
            numbers = "".join(f"{v:>7.0f}" for v in percentiles)
            print(f"{name:14}{low:>5}-{low + 1:<3}{count:>8}{mean:>7.0f}{sd:>6.0f}{numbers}")
