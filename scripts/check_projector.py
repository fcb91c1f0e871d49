"""Compares projections with independent ones: RTK's Joseph projector and rays sampled with SciPy.

    python3 -m venv /tmp/check && /tmp/check/bin/pip install numpy scipy itk-rtk
    cargo run --release --example cross_check -- results/cross_check
    /tmp/check/bin/python scripts/check_projector.py results/cross_check

The same on slices of a real CT (any DICOM series):

    /tmp/check/bin/python scripts/check_projector.py --convert SERIES_FOLDER results/ct.nii.gz
    cargo run --release --example cross_check -- results/cross_check_ct results/ct.nii.gz
    /tmp/check/bin/python scripts/check_projector.py results/cross_check_ct

Prints RMS and largest difference in per cent of the image's maximum; how far the images lie from each other, and what half a pixel
or half a voxel would look like. Fails when an RMS is above 0.5 % or a displacement above 0.05 px.

ITK reads the volume, so origin, direction and voxel centres are its own. RTK takes the volume in the camera's frame; its rays,
steps (one voxel along the main axis) and interpolation (bilinear in planes) are its own. SciPy interpolates linearly at depths that
are not the projector's: every 0.31 mm along each ray, from a place of its own.
"""

import csv
import pathlib
import sys

import itk
import numpy as np
from itk import RTK as rtk
from scipy.ndimage import map_coordinates


def convert(folder, target):
    names = itk.GDCMSeriesFileNames.New()
    names.SetDirectory(folder)
    files = names.GetFileNames(names.GetSeriesUIDs()[0])
    itk.imwrite(itk.imread(files, itk.SS), target)


class Camera:
    def __init__(self, row):
        self.size = (int(row["width"]), int(row["height"]))
        self.pixel = float(row["pixel_mm"])
        self.sdd = float(row["source_detector_mm"])
        self.principal = np.array([float(row["principal_x"]), float(row["principal_y"])])
        pose = np.array([float(v) for v in row["camera_from_volume"].split()]).reshape(3, 4)
        self.rotation, self.shift = pose[:, :3], pose[:, 3]


def attenuation(path):
    """Per mm, with a border of air, as the simulation gives a CT."""
    ct = itk.imread(str(path), itk.SS)
    values = np.pad(np.maximum(0, (itk.array_from_image(ct) + 130.0) * 2.68275e-5), 1)
    volume = itk.image_from_array(values.astype(np.float32))
    origin, direction, spacing = geometry(ct)
    volume.SetSpacing(spacing.tolist())
    volume.SetDirection(ct.GetDirection())
    volume.SetOrigin((origin - direction @ spacing).tolist())
    return values, volume


def geometry(volume):
    direction = itk.array_from_matrix(volume.GetDirection())
    return np.array(volume.GetOrigin()), direction, np.array(volume.GetSpacing())


def joseph(volume, camera, pixels=(0.0, 0.0), voxels=(0.0, 0.0, 0.0)):
    """RTK's image. The source lies at (0, 0, SID) in its frame, ours at the origin: SID is any number."""
    sid = 500.0
    origin, direction, spacing = geometry(volume)
    origin = origin + direction @ (spacing * np.array(voxels))
    moved = itk.image_duplicator(volume)
    moved.SetDirection(itk.matrix_from_array(np.ascontiguousarray(camera.rotation @ direction)))
    moved.SetOrigin((camera.rotation @ origin + camera.shift + [0, 0, sid]).tolist())
    shape = rtk.ThreeDCircularProjectionGeometry.New()
    shape.AddProjection(sid, camera.sdd, 0.0)
    image_type = itk.Image[itk.F, 3]
    empty = rtk.ConstantImageSource[image_type].New()
    first = (np.array(pixels) - camera.principal) * camera.pixel
    empty.SetOrigin([first[0], first[1], 0.0])
    empty.SetSpacing([camera.pixel, camera.pixel, 1.0])
    empty.SetSize([camera.size[0], camera.size[1], 1])
    projector = rtk.JosephForwardProjectionImageFilter[image_type, image_type].New()
    projector.SetGeometry(shape)
    projector.SetInput(0, empty.GetOutput())
    projector.SetInput(1, moved)
    projector.Update()
    return itk.array_from_image(projector.GetOutput())[0].astype(float)


def sampled(values, grid, camera, columns, rows, step=0.31, start=0.173):
    """Line integrals of an array (k, j, i) by SciPy, for the given columns and rows."""
    origin, direction, spacing = grid
    size = np.array(values.shape[::-1])
    corners = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)]) * (size - 1)
    depth = -((origin + (corners * spacing) @ direction.T) @ camera.rotation.T + camera.shift)[:, 2]
    image = np.zeros((len(rows), len(columns)))
    to_index = (direction / spacing).T
    for n, v in enumerate(rows):
        across = np.stack(
            [
                (np.array(columns) - camera.principal[0]) * camera.pixel,
                np.full(len(columns), (v - camera.principal[1]) * camera.pixel),
                np.full(len(columns), -camera.sdd),
            ],
            axis=1,
        )
        across /= np.linalg.norm(across, axis=1)[:, None]
        far = 1.05 * min(depth.max(), camera.sdd)
        along = np.arange(max(depth.min(), 0.0) - 2 * step + start, far, step)
        points = across[:, None, :] * along[None, :, None]
        # Nothing lies behind the detector.
        points = np.where(points[..., 2:] >= -camera.sdd, points, 1e6)
        world = (points - camera.shift) @ camera.rotation
        index = (world - origin) @ to_index.T
        found = map_coordinates(values, index[..., ::-1].reshape(-1, 3).T, order=1, mode="constant", cval=0.0)
        image[n] = found.reshape(len(columns), -1).sum(axis=1) * step
    return image


def displacement(ours, theirs):
    """Columns and rows that ours lies from theirs: least squares over the derivatives of theirs."""
    slopes = [-np.gradient(theirs, axis=1).ravel(), -np.gradient(theirs, axis=0).ravel()]
    return np.linalg.lstsq(np.stack(slopes, axis=1), (ours - theirs).ravel(), rcond=None)[0]


def main(folder):
    values, volume = attenuation(folder / "bone.nii.gz")
    body, body_volume = attenuation(folder / "ct.nii.gz")
    failed = False

    def report(name, ours, theirs):
        nonlocal failed
        percent = 100 / theirs.max()
        difference = ours - theirs
        rms = percent * np.sqrt(np.mean(difference**2))
        failed |= rms > 0.5
        print(f"{name:28s} RMS {rms:.3f} %, largest {percent * np.abs(difference).max():6.3f} %", end="")
        return rms

    for row in csv.DictReader(open(folder / "views.csv")):
        scale = round(1 / float(row["factor"]))
        camera = Camera(row)
        name = f"{row['view']} 1/{scale}"
        ours = np.load(folder / f"drr-{row['view']}-{scale}-true.npy").astype(float)
        theirs = joseph(volume, camera)
        report(f"{name} RTK Joseph", ours, theirs)
        off = displacement(ours, theirs)
        failed |= np.abs(off).max() > 0.05
        print(f", off by {off[0]:+.4f} {off[1]:+.4f} px")
        columns, rows = range(camera.size[0]), range(0, camera.size[1], scale // 2)
        report(f"{name} SciPy", ours[:: scale // 2], sampled(values, geometry(volume), camera, columns, rows))
        print()
        if scale == 8:
            for what, kinds in (("pixel", {"pixels": (0.5, 0.5)}), ("voxel", {"voxels": (0.5, 0.5, 0.5)})):
                wrong = joseph(volume, camera, **kinds)
                rms = 100 / wrong.max() * np.sqrt(np.mean((ours - wrong) ** 2))
                off = displacement(ours, wrong)
                print(f"    were RTK half a {what} off: RMS {rms:.3f} %, off by {off[0]:+.4f} {off[1]:+.4f} px")
            # Every 16th row and column of the uncropped fluoroscopy's line integrals.
            full = Camera(row)
            full.pixel = 0.194
            lines = np.load(folder / f"lines-{row['view']}.npy").astype(float)
            full.size = lines.shape[::-1]
            full.principal = (np.array(full.size) - 1) / 2
            places = range(0, full.size[0], 16), range(0, full.size[1], 16)
            report(f"{row['view']} body, SciPy", lines[::16, ::16], sampled(body, geometry(body_volume), full, *places))
            counts = np.load(folder / f"counts-{row['view']}.npy").astype(float)
            mean = 2000 * np.exp(-lines)
            z = (counts - mean) / np.sqrt(mean)
            n = z.size
            # A Poisson sample's standardized square has variance 2 + 1 / mean.
            error = np.sqrt(np.mean(2 + 1 / mean) / n)
            bias, spread = z.mean() * np.sqrt(n), (np.mean(z**2) - 1) / error
            failed |= max(abs(bias), abs(spread)) > 4
            print(f"; counts: mean {bias:+.1f} SE, variance {spread:+.1f} SE from Poisson's")
    return failed


if sys.argv[1] == "--convert":
    convert(sys.argv[2], sys.argv[3])
else:
    sys.exit("a difference is too large" if main(pathlib.Path(sys.argv[1])) else 0)
