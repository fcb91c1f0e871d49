"""Muscle, fat and gas of specimens beside those of a real CT.

    python3 -m venv /tmp/check && /tmp/check/bin/pip install numpy scipy nibabel pydicom
    /tmp/check/bin/python scripts/compare_soft_tissue.py ../shared/data/vhm_ct results/specimens/phantom-1 ...

Slabs as in compare_densities.py. The body is the largest piece above -300 HU of each slice, its holes filled;
3 mm about bone (above 200 HU) and 5 mm under the skin are left out. Peaks and widths (half width at half
maximum / 1.177) are those of the histogram in bins of 2 HU; grain is the SD of what a mean over 5 x 5 pixels
leaves in muscle.
"""

import sys

import numpy
from compare_densities import THRESHOLD_HU, assigned, real
from scipy import ndimage


def soft_tissue(hu):
    """Where soft tissue is, away from bone and skin."""
    soft = numpy.zeros(hu.shape, bool)
    for k, slice_hu in enumerate(hu):
        body = ndimage.binary_opening(slice_hu > -300, iterations=3)
        pieces, _ = ndimage.label(body)
        body = ndimage.binary_fill_holes(pieces == 1 + numpy.argmax(numpy.bincount(pieces.ravel())[1:]))
        bone = ndimage.binary_fill_holes(ndimage.binary_closing(slice_hu > THRESHOLD_HU, iterations=2) & body)
        soft[k] = ndimage.binary_erosion(body, iterations=5) & ~ndimage.binary_dilation(bone, iterations=3)
    return soft


def peak(values, low, high):
    """The histogram's peak between two values and its width, HU."""
    counts, edges = numpy.histogram(values, bins=numpy.arange(low, high + 1, 2))
    counts = ndimage.gaussian_filter1d(counts.astype(float), 2)
    top = counts.argmax()
    above = numpy.where(counts > counts[top] / 2)[0]
    return edges[top] + 1, (edges[above[-1] + 1] - edges[above[0]]) / 2.355


def grain(hu, soft):
    """SD of the finest texture of muscle, HU."""
    muscle = numpy.stack([ndimage.binary_closing(m) for m in soft & (hu > 0) & (hu < 100)])
    muscle = numpy.stack([ndimage.binary_erosion(m, iterations=4) for m in muscle])
    return (hu - ndimage.uniform_filter(hu, (1, 5, 5)))[muscle].std()


if __name__ == "__main__":
    print(f"{'':14}{'muscle HU':>14}{'fat HU':>14}{'grain':>7}{'gas':>8}{'fat':>8}{'between':>9}{'muscle':>8}")
    for folder, read in [(sys.argv[1], real)] + [(folder, assigned) for folder in sys.argv[2:]]:
        hu = read(folder).astype(float)
        soft = soft_tissue(hu)
        values = hu[soft]
        bounds = [(-2000, -300), (-150, -50), (-50, 0), (0, 130)]
        shares = "".join(f"{100 * ((values > a) & (values <= b)).mean():>7.1f}%" for a, b in bounds)
        peaks = "".join("{:>8.0f} +-{:>3.0f}".format(*peak(values, *range_hu)) for range_hu in ((0, 150), (-200, -40)))
        print(f"{folder.rstrip('/').split('/')[-1]:14}{peaks}{grain(hu, soft):>7.1f}{shares}")
