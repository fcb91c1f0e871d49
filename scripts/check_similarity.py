"""Compares the similarity and the reduced images with NumPy and SciPy.

    python3 -m venv /tmp/check && /tmp/check/bin/pip install numpy scipy
    cargo run --release --example cross_check -- results/cross_check
    /tmp/check/bin/python scripts/check_similarity.py results/cross_check

The similarity is written as the paper's supplement has it, patch by patch, in double precision; smoothing and derivatives are SciPy's.
Fails when a similarity differs by more than 1e-6 or a reduced image by more than 1e-5.
"""

import csv
import pathlib
import sys

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import ndimage


def gradients(image, taps, sigma):
    """Along x and y: Gaussian of so many taps, then Sobel, the border replicated."""
    at = np.arange(taps) - taps // 2
    kernel = np.exp(-0.5 * (at / sigma) ** 2)
    kernel = np.outer(kernel, kernel) / kernel.sum() ** 2
    smooth = ndimage.correlate(image.astype(float), kernel, mode="nearest")
    return [ndimage.sobel(smooth, axis=axis, mode="nearest") for axis in (1, 0)]


def similarity(fixed, moving, patch, taps, sigma):
    """Mean of 1 - NCC over both directions and all square patches that lie in the image."""
    costs = []
    for f, m in zip(gradients(fixed, taps, sigma), gradients(moving, taps, sigma)):
        f, m = (sliding_window_view(g, (patch, patch)) for g in (f, m))
        for f_row, m_row in zip(f, m):
            f_row, m_row = (r.reshape(len(r), -1) for r in (f_row, m_row))
            f_row, m_row = (r - r.mean(axis=1, keepdims=True) for r in (f_row, m_row))
            sd = [np.maximum(r.std(axis=1, ddof=1), 1e-6) for r in (f_row, m_row)]
            # A mean over n, deviations of n - 1: facts of the authors' code.
            costs.append(1 - (f_row * m_row).mean(axis=1) / (sd[0] * sd[1]))
    return np.concatenate(costs).mean()


def reduced(counts, scale):
    cropped = counts[50:-50, 50:-50]
    lines = -np.log(np.maximum(cropped, cropped[cropped > 0].min()) / cropped.max())
    smooth = ndimage.gaussian_filter(lines, 0.5 * scale, mode="nearest", truncate=4.0)
    return smooth[::scale, ::scale]


folder = pathlib.Path(sys.argv[1])
failed = False
for row in csv.DictReader(open(folder / "similarities.csv")):
    scale = round(1 / float(row["factor"]))
    fixed = np.load(folder / f"fixed-{row['view']}-{scale}.npy")
    moving = np.load(folder / f"drr-{row['view']}-{scale}-{row['error']}.npy")
    if row["error"] == "true":
        expected = reduced(np.load(folder / f"counts-{row['view']}.npy").astype(float), scale)
        expected = expected[: fixed.shape[0], : fixed.shape[1]]
        worst = np.abs(fixed - expected).max()
        failed |= worst > 1e-5
        print(f"{row['view']} 1/{scale}: reduced image, largest difference {worst:.1e}")
    theirs = similarity(fixed, moving, int(row["patch_px"]), int(row["gaussian_px"]), float(row["gaussian_sigma_px"]))
    ours = float(row["similarity"])
    failed |= abs(ours - theirs) > 1e-6
    print(f"{row['view']} 1/{scale}, {row['error']:4s} pose: {ours:.9f}, NumPy {theirs:.9f}, difference {ours - theirs:+.1e}")
sys.exit("a difference is too large" if failed else 0)
