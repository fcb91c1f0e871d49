"""Writes the small synthetic DICOM series of tests/data/dicom with pydicom, and DCMTK where JPEG is needed.

python -m venv /tmp/venv && /tmp/venv/bin/pip install pydicom==3.0.2 numpy==2.4.6
apt-get install dcmtk
/tmp/venv/bin/python scripts/make_dicom_fixtures.py tests/data/dicom

Every series has 5 columns and 4 rows. Unless a series is about something else, voxel (i, j, k) holds 100 k + 10 j + i - 50 HU,
pixels are 0.5 mm wide and 0.75 mm high, slices 1.25 mm apart, and the names run against the order of slices.
"""

import pathlib
import subprocess
import sys

import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import (
    CTImageStorage,
    DeflatedExplicitVRLittleEndian,
    EnhancedCTImageStorage,
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    RLELossless,
)

ROOT = "1.2.826.0.1.3680043.10.1071"
ROWS, COLUMNS, SLICES = 4, 5, 3
# Row spacing (between rows) comes first in PixelSpacing.
PIXEL_SPACING = [0.75, 0.5]
STEP = 1.25
J, I = np.mgrid[0:ROWS, 0:COLUMNS]


def hounsfield(k):
    return (100 * k + 10 * J + I - 50).astype(np.int64)


def slice_of(k, series=1, **changes):
    """The k'th slice. `changes` are attributes; None removes one. stored, row, column and origin are no attributes."""
    row = np.array(changes.pop("row", [1, 0, 0]), float)
    column = np.array(changes.pop("column", [0, 1, 0]), float)
    origin = np.array(changes.pop("origin", [-10, 20, 30]), float)
    shift = np.array(changes.pop("shift", [0, 0, 0]), float)
    stored = changes.pop("stored", hounsfield(k) + 1024)
    position = origin + k * STEP * np.cross(row, column) + k * shift
    d = Dataset()
    d.SOPClassUID = CTImageStorage
    d.SOPInstanceUID = f"{ROOT}.{series}.{k + 1}"
    d.SpecificCharacterSet = "ISO_IR 100"
    d.ImageType = ["ORIGINAL", "PRIMARY", "AXIAL"]
    d.Modality = "CT"
    d.SeriesDescription = f"Synthetic {series}"
    d.StudyInstanceUID = f"{ROOT}.1000"
    d.SeriesInstanceUID = f"{ROOT}.{series}"
    d.FrameOfReferenceUID = f"{ROOT}.2000"
    d.InstanceNumber = SLICES - k
    d.ImagePositionPatient = [f"{v:.6f}" for v in position]
    d.ImageOrientationPatient = [f"{v:.8f}" for v in [*row, *column]]
    d.PixelSpacing = PIXEL_SPACING
    d.SamplesPerPixel = 1
    d.PhotometricInterpretation = "MONOCHROME2"
    d.Rows, d.Columns = ROWS, COLUMNS
    d.BitsAllocated, d.BitsStored, d.HighBit = 16, 12, 11
    d.PixelRepresentation = 0
    d.RescaleIntercept, d.RescaleSlope = -1024, 1
    d.RescaleType = "HU"
    for keyword, value in changes.items():
        if value is None:
            delattr(d, keyword)
        else:
            setattr(d, keyword, value)
    width = {8: "u1", 16: "<u2", 32: "<u4"}[d.BitsAllocated]
    mask = (1 << d.BitsAllocated) - 1
    d.PixelData = (stored & mask).astype(width).tobytes()
    d["PixelData"].VR = "OB" if d.BitsAllocated == 8 else "OW"
    return d


def write(d, path, syntax=ExplicitVRLittleEndian):
    path.parent.mkdir(parents=True, exist_ok=True)
    d = pydicom.dataset.Dataset(d)
    d.file_meta = FileMetaDataset()
    d.file_meta.TransferSyntaxUID = syntax
    d.file_meta.ImplementationClassUID = f"{ROOT}.1"
    if syntax == RLELossless:
        d.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
        d.compress(RLELossless, encoding_plugin="pydicom", generate_instance_uid=False)
    if syntax == ExplicitVRBigEndian:
        size = d.BitsAllocated // 8
        d.PixelData = np.frombuffer(d.PixelData, f"<u{size}").astype(f">u{size}").tobytes()
    pydicom.dcmwrite(path, d, enforce_file_format=True)


def write_jpeg(d, path, *options):
    """JPEG Lossless by DCMTK."""
    plain = path.with_suffix(".plain")
    write(d, plain)
    subprocess.run(["dcmcjpeg", *options, "+ud", plain, path], check=True)
    plain.unlink()


def series(out, name, count=SLICES, number=1, **changes):
    """A series whose names run against its order. A change that is a function is called with k."""
    for k in range(count):
        here = {key: value(k) if callable(value) else value for key, value in changes.items()}
        write(slice_of(k, series=number, **here), out / name / f"{count - k}.dcm")


def main(out):
    # The first slice in every encoding that is read, and the second for all of them.
    encodings = out / "encodings"
    write(slice_of(1), encodings / "second.dcm")
    for name, syntax in {
        "explicit": ExplicitVRLittleEndian,
        "implicit": ImplicitVRLittleEndian,
        "big_endian": ExplicitVRBigEndian,
        "deflated": DeflatedExplicitVRLittleEndian,
        "rle": RLELossless,
    }.items():
        write(slice_of(0), encodings / f"{name}.dcm", syntax)
    write_jpeg(slice_of(0), encodings / "jpeg_lossless.dcm", "+e1")
    write_jpeg(slice_of(0), encodings / "jpeg_lossless_p14.dcm", "+el", "+sv", "6")

    # An oblique orthonormal pair: a turn about x, then about z.
    a, b = np.radians([20.0, -35.0])
    turn_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    turn_z = np.array([[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]])
    turn = turn_z @ turn_x
    series(out, "oblique", row=turn[:, 0], column=turn[:, 1])
    # Columns run to the feet, so slices in their order run to the back.
    series(out, "coronal", row=[1, 0, 0], column=[0, 0, -1])
    # Signed, all bits stored; the least and the greatest number that 16 bits hold.
    series(
        out,
        "signed",
        BitsStored=16,
        HighBit=15,
        PixelRepresentation=1,
        RescaleIntercept=0,
        stored=lambda k: np.where(I + J == 0, [-32768, 32767, 0][k], hounsfield(k)),
    )
    # 12 bits stored, with rubbish above them.
    series(out, "rubbish_above", stored=lambda k: (hounsfield(k) + 1024) | 0xA000)
    # 12 signed bits, padded with zeros above them.
    series(
        out,
        "signed_12",
        PixelRepresentation=1,
        RescaleIntercept=0,
        stored=lambda k: hounsfield(k) & 0x0FFF,
    )
    # 8 bits hold but 256 values: here each is a tenth.
    series(
        out,
        "bits_8",
        BitsAllocated=8,
        BitsStored=8,
        HighBit=7,
        RescaleSlope=10,
        RescaleIntercept=-50,
        stored=lambda k: (hounsfield(k) + 50) // 10,
    )
    series(out, "bits_32", BitsAllocated=32, BitsStored=32, HighBit=31)
    # Each slice with its own line: the same Hounsfield units, but for the rounding.
    series(
        out,
        "rescale",
        RescaleSlope=lambda k: [1, 0.5, 2][k],
        RescaleIntercept=lambda k: [-1024, -1000, -60][k],
        stored=lambda k: ((hounsfield(k) - [-1024, -1000, -60][k]) / [1, 0.5, 2][k]).astype(np.int64),
    )
    # The first column is padding: -2000 below air, which becomes air; the corner beyond the range is kept.
    series(
        out,
        "padding",
        BitsStored=16,
        HighBit=15,
        PixelRepresentation=1,
        RescaleIntercept=0,
        PixelPaddingValue=-2000,
        PixelPaddingRangeLimit=-1990,
        stored=lambda k: np.where(I == 0, -2000 + 5 * J, hounsfield(k)),
    )
    # A padding value that tissue has as well: it stays what it is.
    series(out, "padding_in_range", PixelPaddingValue=1024)

    series(out, "tilt", shift=[0, STEP * np.tan(np.radians(15)), 0])
    series(out, "high_bit", count=2, HighBit=13)
    series(out, "monochrome1", count=2, PhotometricInterpretation="MONOCHROME1")
    series(out, "no_rescale", count=2, RescaleSlope=None)
    series(out, "us_units", count=2, RescaleType="US")
    series(out, "mr", count=2, Modality="MR")
    series(out, "enhanced", count=2, SOPClassUID=EnhancedCTImageStorage, NumberOfFrames=2)
    series(out, "localizers", count=2, ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
    # The header claims what the file has not.
    series(out, "huge", count=2, Rows=65535, Columns=65535)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
