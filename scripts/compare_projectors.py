"""Milliseconds a DRR beside other programs: one volume, geometry, machine and thread, in interleaved rounds.

    python3 -m venv /tmp/check
    /tmp/check/bin/pip install numpy itk-rtk itk-twoprojectionregistration plastimatch nanodrr diffdrr
    cargo build --release --example projector_speed
    /tmp/check/bin/python scripts/compare_projectors.py [ROUNDS [PIXELS]]

A made-up pelvis of 300 x 250 x 220 voxels of 1 mm on 192 x 192 pixels (PIXELS), AP and oblique. Each image is compared with
samples every 0.125 mm in double precision before its time counts; a time beside a wrong image is worth nothing (ITK's Siddon-Jacobs is much faster on rays that miss the volume, for
one). Ours are projected in batches of eight poses within two degrees, as a population is; theirs know no
batches, and neither does `slice_one`. Processor time,
minima over the rounds (default 7).

RTK's Joseph projector interpolates bilinearly in planes of voxels; ITK's Siddon-Jacobs, Plastimatch's `exact` and DiffDRR's Siddon take the
exact path through voxels without interpolation; nanodrr and DiffDRR's Trilinear interpolate at as many points as make steps of 1 mm. Of Plastimatch, which is a program, a run that casts one ray is subtracted. The rays of nanodrr and
DiffDRR are given to their renderers, so no convention of theirs comes in between.
"""

import csv
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

import itk
import numpy as np
import torch
from diffdrr.renderers import Siddon, Trilinear
from itk import RTK as rtk
from nanodrr.data import Subject
from nanodrr.drr import render

SDD, PIXEL = 1020.0, 1.552
SIZE = int(sys.argv[2]) if len(sys.argv) > 2 else 192
IMAGE = itk.Image[itk.F, 3]
itk.MultiThreaderBase.SetGlobalMaximumNumberOfThreads(1)
itk.MultiThreaderBase.SetGlobalDefaultNumberOfThreads(1)
torch.set_num_threads(1)
torch.set_grad_enabled(False)


def mu(ct):
    """Attenuation per mm, indexed [k, j, i]."""
    return np.maximum(0, (itk.array_from_image(ct) + 130.0) * 2.68275e-5).astype(np.float32)


def moved_volume(path, rotation, shift):
    ct = itk.imread(str(path), itk.SS)
    values = mu(ct)
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
    values = mu(ct)
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


def attenuation(path):
    """The volume (mu per mm, indexed [k, j, i]) and its `world_from_voxel`."""
    ct = itk.imread(str(path), itk.SS)
    affine = np.eye(4)
    affine[:3, :3] = itk.array_from_matrix(ct.GetDirection()) * np.array(ct.GetSpacing())
    affine[:3, 3] = ct.GetOrigin()
    return mu(ct), affine


def rays(rotation, shift):
    """`camera_from_volume`, and where each pixel lies in the camera's frame."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, shift
    across = (np.arange(SIZE) - (SIZE - 1) / 2) * PIXEL
    y, x = np.meshgrid(across, across, indexing="ij")
    return pose, np.stack([x, y, np.full_like(x, -SDD)], axis=-1).reshape(-1, 3)


def steps(pose, affine, shape):
    """How many mm of depth the volume takes, along the steepest ray."""
    corners = np.array(np.meshgrid(*((0, n - 1) for n in shape[::-1]))).reshape(3, -1)
    depths = (pose @ affine)[2, :3] @ corners
    return int(np.ptp(depths) * 1.03) + 2


def timed(work):
    start = time.process_time()
    image = work()
    return np.asarray(image, dtype=float).reshape(SIZE, SIZE), time.process_time() - start


def diffdrr(renderer):
    def make(path, rotation, shift):
        values, affine = attenuation(path)
        pose, pixels = rays(rotation, shift)
        density = torch.from_numpy(np.ascontiguousarray(values.transpose(2, 1, 0)))
        voxel_from_camera = np.linalg.inv(pose @ affine)
        to_voxels = lambda p: torch.from_numpy((p @ voxel_from_camera[:3, :3].T + voxel_from_camera[:3, 3]).astype(np.float32))[None]
        source, target = to_voxels(np.zeros((1, 3))), to_voxels(pixels)
        lengths = torch.from_numpy(np.linalg.norm(pixels, axis=1).astype(np.float32))[None, None]
        project = renderer()
        options = {"n_points": steps(pose, affine, values.shape)} if renderer is Trilinear else {}
        return lambda: timed(lambda: project(density, source, target, lengths, **options))

    return make


def nanodrr(path, rotation, shift):
    values, affine = attenuation(path)
    pose, pixels = rays(rotation, shift)
    tensor = lambda a: torch.from_numpy(np.ascontiguousarray(a, dtype=np.float32))
    grid_from_voxel = np.diag(2.0 / np.array([*values.shape[::-1], 2.0]))
    grid_from_voxel[:3, 3] = 1.0 / np.array(values.shape[::-1]) - 1.0
    image = tensor(values)[None, None]
    subject = Subject(image, torch.zeros_like(image), tensor(affine), tensor(np.linalg.inv(affine)), tensor(grid_from_voxel),
                      torch.zeros(3), max_label=0, convert_to_mu=False)
    samples = steps(pose, affine, values.shape)
    given = {"src": torch.zeros(1, 1, 3), "tgt": tensor(pixels)[None], "n_samples": samples, "backend": "torch"}
    view = (torch.eye(3)[None], tensor(np.linalg.inv(pose))[None], torch.tensor([SDD]), SIZE, SIZE)
    return lambda: timed(lambda: render(subject, *view, **given))


def plastimatch(path, rotation, shift):
    values, affine = attenuation(path)
    folder = pathlib.Path(path).parent / f"plastimatch-{rotation[0, 0]:.6f}"
    folder.mkdir(exist_ok=True)
    volume = itk.image_from_array(values)
    volume.SetSpacing(np.linalg.norm(affine[:3, :3], axis=0).tolist())
    volume.SetOrigin(affine[:3, 3].tolist())
    itk.imwrite(volume, str(folder / "volume.mha"))
    back = rotation.T
    source = -back @ shift
    toward = back @ [0.0, 0.0, 1.0]
    text = lambda v: " ".join(f"{x:.9g}" for x in v)
    command = ["plastimatch", "drr", "-i", "exact", "-P", "none", "-t", "pfm", "-r", f"{SIZE} {SIZE}", "-z", f"{SIZE * PIXEL} {SIZE * PIXEL}",
               "-c", f"{(SIZE - 1) / 2} {(SIZE - 1) / 2}", "--sad", "800", "--sid", str(SDD), f"--nrm={text(toward)}",
               f"--vup={text(back @ [0.0, -1.0, 0.0])}", f"--isocenter={text(source - 800 * toward)}"]
    command[0] = str(pathlib.Path(sys.executable).parent / "plastimatch")

    def seconds(*more):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([*command, *more, "-O", str(folder / "drr"), str(folder / "volume.mha")], check=True, stdout=subprocess.DEVNULL,
                       env={**os.environ, "OMP_NUM_THREADS": "1"})
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime

    def run():
        for old in folder.glob("drr*"):
            old.unlink()
        without = min(seconds("-w", "0 0 0 0") for _ in range(3))
        whole = min(seconds() for _ in range(3))
        raw = next(folder.glob("drr*.pfm")).read_bytes()
        image = np.frombuffer(raw[-4 * SIZE * SIZE :], np.float32).reshape(SIZE, SIZE)
        # Its columns run the other way, and its lengths are in cm.
        return 10.0 * image[:, ::-1], whole - without

    return run


PEERS = [
    ("RTK Joseph", joseph),
    ("ITK Siddon-Jacobs", siddon),
    ("Plastimatch exact", plastimatch),
    ("nanodrr", nanodrr),
    ("DiffDRR Trilinear", diffdrr(Trilinear)),
    ("DiffDRR Siddon", diffdrr(Siddon)),
]


def difference(image, truth):
    percent = 100 / truth.max()
    return percent * np.sqrt(np.mean((image - truth) ** 2)), np.corrcoef(image.ravel(), truth.ravel())[0, 1]


def main(rounds):
    program = pathlib.Path(__file__).parent.parent / "target/release/examples/projector_speed"
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        ours = subprocess.Popen([program, folder, str(SIZE)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert ours.stdout.readline().strip() == "ready"
        rows = list(csv.DictReader(open(folder / "views.csv")))
        peers = {}
        for row in rows:
            pose = np.array([float(v) for v in row["camera_from_volume"].split()]).reshape(3, 4)
            for name, make in PEERS:
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
                share = ("" if (view, name) in peers else f"1/{fastest / t:.1f}") if fit else "the image is wrong"
                print(f"| {name} | {t:.2f} | {share} | {rms:.3f} | {r:.6f} |")
    return wrong


if __name__ == "__main__":
    sys.exit("an image is wrong" if main(int(sys.argv[1]) if len(sys.argv) > 1 else 7) else 0)
