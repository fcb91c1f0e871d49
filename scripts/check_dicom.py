"""Compares a DICOM series as pao-sim reads it with pydicom's and SimpleITK's array and affine, voxel by voxel.

python -m venv /tmp/venv && /tmp/venv/bin/pip install pydicom==3.0.2 SimpleITK==2.5.7 nibabel==5.4.2 numpy==2.4.6
cargo run --release --example dicom_to_nifti -- FOLDER /tmp/ct.nii
/tmp/venv/bin/python scripts/check_dicom.py FOLDER /tmp/ct.nii
"""

import pathlib
import sys

import nibabel
import numpy as np
import pydicom
import SimpleITK


def by_pydicom(folder):
    """Hounsfield units [i, j, k] and the affine (LPS mm), from the attributes alone."""
    files = [pydicom.dcmread(f) for f in pathlib.Path(folder).iterdir() if pydicom.misc.is_dicom(f)]
    cosines = np.array(files[0].ImageOrientationPatient, float)
    row, column = cosines[:3], cosines[3:]
    normal = np.cross(row, column)
    position = lambda d: np.array(d.ImagePositionPatient, float)
    files.sort(key=lambda d: position(d) @ normal)
    hu = np.stack([d.pixel_array.T * float(d.RescaleSlope) + float(d.RescaleIntercept) for d in files], axis=2)
    between_rows, between_columns = (float(v) for v in files[0].PixelSpacing)
    affine = np.eye(4)
    affine[:3, 0] = row * between_columns
    affine[:3, 1] = column * between_rows
    affine[:3, 2] = (position(files[-1]) - position(files[0])) / (len(files) - 1)
    affine[:3, 3] = position(files[0])
    return hu, affine


def by_simpleitk(folder):
    reader = SimpleITK.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(folder)))
    image = reader.Execute()
    hu = SimpleITK.GetArrayFromImage(image).transpose(2, 1, 0)
    affine = np.eye(4)
    affine[:3, :3] = np.reshape(image.GetDirection(), (3, 3)) * image.GetSpacing()
    affine[:3, 3] = image.GetOrigin()
    return hu, affine


def main(folder, nifti):
    ours = nibabel.load(nifti)
    hu = np.asanyarray(ours.dataobj)
    affine = np.diag([-1, -1, 1, 1]) @ ours.affine
    print(f"{folder}: {hu.shape}, {hu.dtype}, {hu.min()} to {hu.max()} HU, sum {hu.sum(dtype=np.int64)}")
    same = True
    for name, (theirs, theirs_affine) in {"pydicom": by_pydicom(folder), "SimpleITK": by_simpleitk(folder)}.items():
        if theirs.shape != hu.shape:
            print(f"{name}: shape {theirs.shape}")
            same = False
            continue
        # Whole Hounsfield units, halves away from zero.
        whole = np.trunc(theirs + np.copysign(0.5, theirs))
        different = int((whole != hu).sum())
        corners = np.array([[i, j, k, 1] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * [*np.array(hu.shape) - 1, 1]
        apart = np.linalg.norm(corners @ (affine - theirs_affine).T, axis=1).max()
        print(f"{name}: {different} of {hu.size} voxels differ, corners at most {apart:.2g} mm apart")
        same &= different == 0 and apart < 1e-3
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
