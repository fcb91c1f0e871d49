"""Writes tests/data/volumes: one small volume in every format, by other programs than ours.

    python3 -m venv /tmp/check && /tmp/check/bin/pip install SimpleITK==2.5.7 pynrrd==1.1.3 nibabel==5.4.2 numpy
    /tmp/check/bin/python scripts/write_volume_fixtures.py tests/data/volumes

A volume of 5 x 6 x 7 anisotropic voxels without any symmetry lies in the world in two ways: `oblique`, turned about all axes, and
`permuted`, its axes along the world's in another order, two of them reversed. For each, NAME.csv lists every voxel with the value and
the LPS position that SimpleITK gives it; NAME_what.ext are the files. Every file is read back with SimpleITK, and its values and
positions are compared with the list, so that what is expected comes from two programs.
"""

import gzip
import pathlib
import sys

import nibabel
import nrrd
import numpy as np
import SimpleITK as sitk

out = pathlib.Path(sys.argv[1])
out.mkdir(parents=True, exist_ok=True)

DIMS = (5, 6, 7)
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0])
LPS_FROM_LAS = np.diag([1.0, -1.0, 1.0])


def turn(axis, angle):
    m = np.eye(3)
    a, b = [(1, 2), (2, 0), (0, 1)][axis]
    m[a, a] = m[b, b] = np.cos(angle)
    m[b, a] = np.sin(angle)
    m[a, b] = -m[b, a]
    return m


PLACES = {
    "oblique": (turn(2, 0.5) @ turn(1, -0.3) @ turn(0, 0.2), (0.5, 0.75, 2.0), (-10.0, 20.0, 300.5)),
    # Axis i goes to the patient's right, j up, k forward.
    "permuted": (np.array([[-1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]]), (1.5, 1.0, 0.25), (42.0, -7.5, -1000.25)),
}


def values(low, high):
    """No two planes are alike; i fastest, as [k, j, i]."""
    rng = np.random.default_rng(5)
    return rng.integers(low, high, DIMS[::-1], endpoint=True)


def image(array, name):
    direction, spacing, origin = PLACES[name]
    made = sitk.GetImageFromArray(array)
    made.SetDirection(direction.flatten())
    made.SetSpacing(spacing)
    made.SetOrigin(origin)
    return made


def write_list(name, ct):
    lines = ["i,j,k,hu,x_lps_mm,y_lps_mm,z_lps_mm"]
    for k in range(DIMS[2]):
        for j in range(DIMS[1]):
            for i in range(DIMS[0]):
                place = ct.TransformIndexToPhysicalPoint((i, j, k))
                lines.append(f"{i},{j},{k},{ct[i, j, k]}," + ",".join(f"{v:.9g}" for v in place))
    (out / f"{name}.csv").write_text("\n".join(lines) + "\n")


def check(file, name, array, tolerance=1e-9):
    found, expected = sitk.ReadImage(str(file)), image(array, name)
    assert found.GetSize() == DIMS, file
    assert (sitk.GetArrayFromImage(found) == array).all(), file
    for k in range(DIMS[2]):
        for j in range(DIMS[1]):
            for i in range(DIMS[0]):
                a, b = (np.array(x.TransformIndexToPhysicalPoint((i, j, k))) for x in (found, expected))
                assert np.abs(a - b).max() <= tolerance, (file, (i, j, k), a, b)


def nrrd_header(name, space, **more):
    direction, spacing, origin = PLACES[name]
    to = {
        "left-posterior-superior": np.eye(3),
        "LPS": np.eye(3),
        "right-anterior-superior": LPS_FROM_RAS,
        "RAS": LPS_FROM_RAS,
        "left-anterior-superior": LPS_FROM_LAS,
        "LAS": LPS_FROM_LAS,
    }[space]
    directions = to @ direction @ np.diag(spacing)
    header = {"space": space, "space directions": directions.T, "space origin": to @ np.array(origin)}
    return header | {"kinds": ["domain"] * 3} | more


def write_nifti(file, name, array, form):
    direction, spacing, origin = PLACES[name]
    affine = np.eye(4)
    affine[:3, :3] = LPS_FROM_RAS @ direction @ np.diag(spacing)
    affine[:3, 3] = LPS_FROM_RAS @ np.array(origin)
    made = nibabel.Nifti1Image(array.T, None)
    made.header.set_xyzt_units("mm")
    made.set_sform(affine, code=1 if form == "sform" else 0)
    made.set_qform(affine, code=1 if form == "qform" else 0)
    nibabel.save(made, file)
    check(file, name, array, 1e-3)


for name in PLACES:
    hu = values(-1024, 3071).astype(np.int16)
    ct = image(hu, name)
    write_list(name, ct)
    # SimpleITK
    for suffix, compress in [
        ("raw.mha", False),
        ("zlib.mha", True),
        ("raw.mhd", False),
        ("zlib.mhd", True),
        ("raw.nrrd", False),
        ("gzip.nrrd", True),
        ("raw.nhdr", False),
        ("gzip.nhdr", True),
        ("itk.nii", False),
        ("itk.nii.gz", True),
    ]:
        file = out / f"{name}_{suffix}"
        sitk.WriteImage(ct, str(file), compress)
        check(file, name, hu, 1e-3 if "nii" in suffix else 1e-9)
    # pynrrd: every world, text, the other byte order, detached headers
    for space in ("left-posterior-superior", "right-anterior-superior", "left-anterior-superior", "LPS", "RAS", "LAS"):
        file = out / f"{name}_{space}.nrrd"
        nrrd.write(str(file), hu.T, nrrd_header(name, space, encoding="gzip"))
        check(file, name, hu)
    file = out / f"{name}_text.nrrd"
    nrrd.write(str(file), hu.T, nrrd_header(name, "RAS", encoding="text"))
    check(file, name, hu)
    file = out / f"{name}_big.nhdr"
    nrrd.write(str(file), hu.T.astype(">i2"), nrrd_header(name, "RAS", encoding="raw"), detached_header=True)
    assert "endian: big" in file.read_text()
    check(file, name, hu)
    # nibabel
    write_nifti(out / f"{name}_sform.nii.gz", name, hu, "sform")
    write_nifti(out / f"{name}_qform.nii", name, hu, "qform")

# Every type of number, once in each format; the values fit them all.
small = values(0, 127)
types = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"]
for kind in types:
    array = small.astype(kind)
    for suffix in ("mha", "nrrd"):
        file = out / f"type_{kind}.{suffix}"
        sitk.WriteImage(image(array, "oblique"), str(file), True)
        check(file, "oblique", array)
np.savetxt(out / "type.csv", small.reshape(-1, 1), fmt="%d")

# What SimpleITK reads and does not write: edited headers, read back by it.
hu = values(-1024, 3071).astype(np.int16)
lines = (out / "oblique_raw.mhd").read_text()
raw = (out / "oblique_raw.raw").read_bytes()
big = hu.astype(">i2").tobytes()
edits = {
    "big": (lines.replace("OrderMSB = False", "OrderMSB = True"), big),
    "text": (
        lines.replace("BinaryData = True", "BinaryData = False"),
        " ".join(str(v) for v in hu.flatten()).encode() + b"\n",
    ),
    "skip": (lines.replace("ElementType", "HeaderSize = 11\nElementType"), b"eleven more" + raw),
    "last": (lines.replace("ElementType", "HeaderSize = -1\nElementType"), b"any number of bytes" + raw),
    "names": (
        lines.replace("TransformMatrix", "Rotation")
        .replace("Offset", "Position")
        .replace("ElementSpacing", "ElementSize")
        .replace("BinaryDataByteOrderMSB", "ElementByteOrderMSB"),
        raw,
    ),
}
for what, (header, data) in edits.items():
    (out / f"oblique_{what}.raw").write_bytes(data)
    file = out / f"oblique_{what}.mhd"
    file.write_text(header.replace("oblique_raw.raw", f"oblique_{what}.raw"))
    check(file, "oblique", hu)
lines = (out / "oblique_raw.nhdr").read_text()
gz = gzip.compress(b"eleven more" + raw, mtime=0)
edits = {
    "lineskip": (lines.replace("encoding", "line skip: 2\nbyte skip: 3\nencoding"), b"one\ntwo\nabc" + raw),
    "byteskip": (
        lines.replace("encoding: raw", "byte skip: 11\nline skip: 1\nencoding: gzip"),
        b"a line\n" + gz,
    ),
    "atend": (lines.replace("encoding", "byte skip: -1\nencoding"), b"any number of bytes" + raw),
}
for what, (header, data) in edits.items():
    (out / f"oblique_{what}.raw").write_bytes(data)
    file = out / f"oblique_{what}.nhdr"
    file.write_text(header.replace("oblique_raw.raw", f"oblique_{what}.raw"))
    check(file, "oblique", hu)

# A segmentation with Slicer's keys: three segments in one layer.
layers = small.astype(np.uint8) % 4
keys = {"Segmentation_SourceRepresentation": "Binary labelmap", "Segmentation_ReferenceImageExtentOffset": "10 20 30"}
for n, (segment, label) in enumerate([("left hip", 2), ("right hip", 1), ("sacrum", 3)]):
    keys |= {f"Segment{n}_Name": segment, f"Segment{n}_LabelValue": str(label), f"Segment{n}_Layer": "0"}
file = out / "layers.seg.nrrd"
nrrd.write(str(file), layers.T, nrrd_header("oblique", "LPS", encoding="gzip", **keys))
check(file, "oblique", layers)

print(sum(1 for _ in out.iterdir()), "files,", sum(f.stat().st_size for f in out.iterdir()), "bytes")
