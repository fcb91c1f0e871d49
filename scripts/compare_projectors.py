"""Milliseconds a DRR beside other programs: one volume, geometry, machine and thread, in interleaved rounds.

    python3 -m venv /tmp/check && /tmp/check/bin/pip install numpy itk-rtk itk-twoprojectionregistration
    cargo build --release --example projector_speed
    /tmp/check/bin/python scripts/compare_projectors.py [ROUNDS]

A made-up pelvis of 300 x 250 x 220 voxels of 1 mm on 192 x 192 pixels, AP and oblique. Each image is compared with
samples every 0.125 mm in double precision before its time counts; a time beside a wrong image is worth nothing (ITK's Siddon-Jacobs is much faster on rays that miss the volume, for
one). Ours are projected in batches of eight poses within two degrees, as a population is; theirs know no
batches, and neither does `slice_one`. Processor time,
minima over the rounds (default 7).

RTK's Joseph projector interpolates bilinearly in planes of voxels; ITK's Siddon-Jacobs takes the exact path through voxels without
interpolation.
"""

import csv
import pathlib
import subprocess
import sys
import tempfile
import time

import itk
import numpy as np
from itk import RTK as rtk

SDD, PIXEL, SIZE = 1020.0, 1.552, 192
IMAGE = itk.Image[itk.F, 3]
itk.MultiThreaderBase.SetGlobalMaximumNumberOfThreads(1)
itk.MultiThreaderBase.SetGlobalDefaultNumberOfThreads(1)


def moved_volume(path, rotation, shift):
    ct = itk.imread(str(path), itk.SS)
    values = np.maximum(0, (itk.array_from_image(ct) + 130.0) * 2.68275e-5).astype(np.float32)
    volume = itk.image_from_array(values)
    volume.SetSpacing(np.array(ct.GetSpacing()).tolist())
    direction = itk.array_from_matrix(ct.GetDirection())
    volume.SetDirection(itk.matrix_from_array(np.ascontiguousarray(rotation @ direction)))
    volume.SetOrigin((rotation @ np.array(ct.GetOrigin()) + shift).tolist())
    return volume


def joseph(path, rotation, shift):
    """RTK with the source at (0, 0, 500) of its frame; ours is at the origin."""
    geometry = rtk.ThreeDCircularProjectionGeometry.New()
    geometry.AddProjection(500.0, SDD, 0.0)
    empty = rtk.ConstantImageSource[IMAGE].New()
    first = -(SIZE - 1) / 2 * PIXEL
    empty.SetOrigin([first, first, 0.0])
    empty.SetSpacing([PIXEL, PIXEL, 1.0])
    empty.SetSize([SIZE, SIZE, 1])
    projector = rtk.JosephForwardProjectionImageFilter[IMAGE, IMAGE].New()
    projector.SetGeometry(geometry)
    projector.SetInput(0, empty.GetOutput())
    projector.SetInput(1, moved_volume(path, rotation, shift + [0, 0, 500.0]))
    projector.SetNumberOfWorkUnits(1)
    projector.InPlaceOff()
    empty.Update()

    def run():
        projector.Modified()
        start = time.process_time()
        projector.Update()
        return itk.array_from_image(projector.GetOutput())[0].astype(float), time.process_time() - start

    return run


def siddon(path, rotation, shift):
    """ITK's ray caster of two-projection registration. It takes the volume's corner to be at the origin and its axes to be the
    world's, so the pose goes into its transform; its sums are in parts of the ray."""
    ct = itk.imread(str(path), itk.SS)
    values = np.maximum(0, (itk.array_from_image(ct) + 130.0) * 2.68275e-5).astype(np.float32)
    volume = itk.image_from_array(values)
    size = np.array(values.shape[::-1], dtype=float)
    middle = size / 2
    volume.SetSpacing([1.0, 1.0, 1.0])
    volume.SetOrigin([0.0, 0.0, 0.0])
    center = rotation @ (np.array(ct.GetOrigin()) + (size - 1) / 2) + shift
    transform = itk.Euler3DTransform[itk.D].New()
    # It then turns the volume by -90 degrees about x, which is undone here.
    back = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    transform.SetMatrix(itk.matrix_from_array(np.ascontiguousarray(back @ rotation)))
    transform.SetCenter(middle.tolist())
    distance = -center[2]
    interpolator = itk.SiddonJacobsRayCastInterpolateImageFunction[IMAGE, itk.D].New()
    interpolator.SetFocalPointToIsocenterDistance(distance)
    interpolator.SetProjectionAngle(0.0)
    interpolator.SetThreshold(0.0)
    interpolator.SetTransform(transform)
    interpolator.Initialize()
    resample = itk.ResampleImageFilter[IMAGE, IMAGE].New()
    resample.SetInput(volume)
    resample.SetDefaultPixelValue(0)
    resample.SetNumberOfWorkUnits(1)
    resample.SetTransform(itk.IdentityTransform[itk.D, 3].New())
    resample.SetInterpolator(interpolator)
    resample.SetSize([SIZE, SIZE, 1])
    resample.SetOutputSpacing([PIXEL, PIXEL, 1.0])
    first = -(SIZE - 1) / 2 * PIXEL
    resample.SetOutputOrigin([first, first, -SDD])
    across = (np.arange(SIZE) - (SIZE - 1) / 2) * PIXEL
    length = np.sqrt(SDD**2 + across[None, :] ** 2 + across[:, None] ** 2)

    def run():
        resample.Modified()
        start = time.process_time()
        resample.Update()
        return itk.array_from_image(resample.GetOutput())[0].astype(float) * length, time.process_time() - start

    return run


def difference(image, truth):
    percent = 100 / truth.max()
    return percent * np.sqrt(np.mean((image - truth) ** 2)), np.corrcoef(image.ravel(), truth.ravel())[0, 1]


def main(rounds):
    program = pathlib.Path(__file__).parent.parent / "target/release/examples/projector_speed"
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        ours = subprocess.Popen([program, folder], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert ours.stdout.readline().strip() == "ready"
        rows = list(csv.DictReader(open(folder / "views.csv")))
        peers = {}
        for row in rows:
            pose = np.array([float(v) for v in row["camera_from_volume"].split()]).reshape(3, 4)
            for name, make in (("RTK Joseph", joseph), ("ITK Siddon-Jacobs", siddon)):
                if (row["view"], name) not in peers:
                    peers[row["view"], name] = [make(folder / "volume.nii.gz", pose[:, :3], pose[:, 3]), np.inf]
        read = lambda name: np.fromfile(folder / f"{name}.f32", np.float32).reshape(SIZE, SIZE).astype(float)
        truth = {view: read(f"{view}-exact") for view, _ in peers}
        table, wrong = [], False
        for (view, name), (run, _) in peers.items():
            table.append([view, name, *difference(run()[0], truth[view])])
        for row in rows:
            image = read(f"{row['view']}-{row['projector']}-{row['level']}")
            name = f"{row['projector']} {row['level']}"
            table.append([row["view"], name, *difference(image, truth[row["view"]])])
        best = np.full(len(rows), np.inf)
        for _ in range(rounds):
            ours.stdin.write("\n")
            ours.stdin.flush()
            best = np.minimum(best, [float(v) for v in ours.stdout.readline().split()])
            for peer in peers.values():
                peer[1] = min(peer[1], peer[0]()[1])
        ours.stdin.close()
        times = [1e3 * peer[1] for peer in peers.values()] + list(best)
        for view in truth:
            good = [(t, row) for t, row in zip(times, table) if row[0] == view]
            fastest = min(t for t, row in good if (view, row[1]) in peers and row[3] > 0.99)
            print(f"\n| {view} | ms | of the fastest peer | RMS (% of maximum) | correlation |\n|---|---|---|---|---|")
            for t, (_, name, rms, r) in good:
                fit = r > 0.99
                wrong |= not fit
                share = f"1/{fastest / t:.1f}" if fit else "the image is wrong"
                print(f"| {name} | {t:.2f} | {share} | {rms:.3f} | {r:.6f} |")
    return wrong


if __name__ == "__main__":
    sys.exit("an image is wrong" if main(int(sys.argv[1]) if len(sys.argv) > 1 else 7) else 0)
