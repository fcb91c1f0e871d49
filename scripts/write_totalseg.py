"""Writes a multi-label file as TotalSegmentator's task total does, with nibabel: tests/data/totalseg.nii.gz.

    python scripts/write_totalseg.py OUT

The values are those of class map 2; the label table is a Caret extension of code 0, as the program writes it. Two
more extensions lie around it. 3 x 4 x 5 voxels; every voxel's value tells its place.
"""

import sys

import nibabel
import numpy as np

CLASSES = {1: "spleen", 25: "sacrum", 26: "vertebrae_S1", 75: "femur_left", 76: "femur_right", 77: "hip_left",
           78: "hip_right"}

values = np.array([0, 25, 77, 78, 75, 76, 1], "u1")
i, j, k = np.meshgrid(np.arange(3), np.arange(4), np.arange(5), indexing="ij")
image = nibabel.Nifti1Image(values[(k * 12 + j * 3 + i) % 7], np.diag([-1.5, -1.5, 1.5, 1]))
image.header.set_xyzt_units("mm")
labels = "".join(f'<Label Key="{key}" Red="1.0" Green="0.5" Blue="0.0" Alpha="1"><![CDATA[{name}]]></Label>\n'
                 for key, name in CLASSES.items())
table = ('<?xml version="1.0" encoding="UTF-8"?> <CaretExtension>  <VolumeInformation Index="0">   <LabelTable>\n'
         f"{labels}\n</LabelTable>  <VolumeType><![CDATA[Label]]></VolumeType>   </VolumeInformation>"
         "</CaretExtension>\n              ")
for code, text in [(6, "a comment"), (0, table), (4, "<AFNI_attributes/>")]:
    image.header.extensions.append(nibabel.nifti1.Nifti1Extension(code, text.encode()))
nibabel.save(image, sys.argv[1])
