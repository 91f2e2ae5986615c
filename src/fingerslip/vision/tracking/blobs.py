"""Round spots of an image that are brighter or darker than what is around them, and fields of those that are alike."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from fingerslip.arrays import Flags, Floats
from fingerslip.vision.video import opencv

# Radii that are tried [px]. Larger blobs than the finest are looked for in an image that is as much smaller.
_RADII = tuple(1.7 * 2.0 ** (step / 3.0) for step in range(14))
_FINEST = 4.0
_SMALLEST_SIDE = 12  # px of a reduced image
# Hessians of edges and lines have one large eigenvalue; 1 is a round blob.
_ROUNDNESS = 0.35
_FAINTEST = 1.0  # grey levels
# Two blobs nearer than this share of their radii are the same, seen at two sizes.
_PART = 4.0
# Blobs are alike within this ratio of strengths and of radii; none of a field is farther from the next than so many
# times the median.
_STRENGTHS, _SIZES, _GAP = 2.5, 1.3, 2.2
_FEWEST, _AS_STRONG, _WITHIN = 3, 0.75, 1.25


@dataclass(frozen=True)
class Blobs:
    """Blobs of an image."""

    position: Floats  # (n, 2), centres, x and y [px]
    strength: Floats  # (n,) [grey levels]
    radius: Floats  # (n,) [px]

    def select(self, rows: Flags | NDArray[np.intp]) -> Blobs:
        """Return some of the blobs."""
        return Blobs(self.position[rows], self.strength[rows], self.radius[rows])

    def inside(self, mask: Flags | None) -> Blobs:
        """Return the blobs on the pixels of a mask (height, width) that count; all without one."""
        if mask is None:
            return self
        columns, rows = np.rint(self.position).astype(np.intp).T
        return self.select(mask[rows.clip(0, len(mask) - 1), columns.clip(0, mask.shape[1] - 1)])


def reduced_to(image: NDArray[np.generic], radius: float) -> tuple[NDArray[np.generic], int]:
    """Return an image (height, width) with as few pixels as blobs of a radius [px] need, and how much smaller it is."""
    shrink = max(1, int(radius / _FINEST))
    height, width = (length // shrink for length in image.shape)
    if shrink == 1 or min(height, width) < 1:
        return np.ascontiguousarray(image), 1
    # Whole pixels become one, which is exact and fast.
    whole = image[: height * shrink, : width * shrink]
    return opencv().resize(whole, (width, height), interpolation=opencv().INTER_AREA), shrink


def blobs_of(image: NDArray[np.generic], radius: float, polarity: float, least: float = _FAINTEST) -> Blobs:
    """Return the blobs of a radius: maxima of the scale-normalised Laplacian of a Gaussian (Lindeberg 1998).

    A disk of radius r answers most at a standard deviation of r / √2. Arrays: image (height, width) [grey levels].
    """
    cv2, (reduced, shrink) = opencv(), reduced_to(image, radius)
    if min(reduced.shape) < _SMALLEST_SIDE:
        return Blobs(np.empty((0, 2)), np.empty(0), np.empty(0))
    sigma = radius / shrink / math.sqrt(2.0)
    smooth = cv2.GaussianBlur(reduced.astype(np.float32), (0, 0), sigma)
    answer = cv2.Laplacian(smooth, cv2.CV_32F, ksize=1, scale=-polarity * sigma**2)
    side = 2 * math.ceil(0.8 * radius / shrink) + 1
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    rows, columns = np.nonzero((answer >= cv2.dilate(answer, disk)) & (answer > least))
    inside = (rows > 0) & (rows < reduced.shape[0] - 1) & (columns > 0) & (columns < reduced.shape[1] - 1)
    rows, columns = rows[inside], columns[inside]
    # The parabola through the three values along each axis has its top between pixels.
    top = answer[rows, columns]
    up, down, back, ahead = rows - 1, rows + 1, columns - 1, columns + 1
    left, right, above, below = answer[rows, back], answer[rows, ahead], answer[up, columns], answer[down, columns]
    along, across = 2.0 * top - left - right, 2.0 * top - above - below
    x = columns + 0.5 * (right - left) / np.maximum(along, 1e-6)
    y = rows + 0.5 * (below - above) / np.maximum(across, 1e-6)
    mixed = 0.25 * (smooth[down, ahead] + smooth[up, back] - smooth[up, ahead] - smooth[down, back])
    xx = smooth[rows, back] + smooth[rows, ahead] - 2.0 * smooth[rows, columns]
    yy = smooth[up, columns] + smooth[down, columns] - 2.0 * smooth[rows, columns]
    is_round = 4.0 * (xx * yy - mixed**2) > _ROUNDNESS * (xx + yy) ** 2
    places = (np.column_stack([x, y]) + 0.5) * shrink - 0.5
    return Blobs(places[is_round], top[is_round].astype(np.float64), np.full(int(is_round.sum()), radius))


def field_of(image: Floats, mask: Flags | None, polarity: float) -> Blobs:
    """Return the blobs that are alike in size and strength and lie together: of all such fields the strongest."""
    noise = float(np.median(np.abs(np.diff(image, axis=1)))) / (0.6745 * math.sqrt(2.0))
    scales = [blobs_of(image, radius, polarity, max(_FAINTEST, 3.5 * noise / radius)) for radius in _RADII]
    blobs = Blobs(*(np.concatenate([getattr(s, n) for s in scales]) for n in ("position", "strength", "radius")))
    blobs = blobs.inside(mask)
    if not len(blobs.strength):
        return blobs
    # What lies within a stronger blob, and is not much smaller, is a part of it.
    strongest = np.ones(len(blobs.strength), dtype=bool)
    first, second = cKDTree(blobs.position).query_pairs(blobs.radius.max(), output_type="ndarray").T
    swap = blobs.strength[first] < blobs.strength[second]
    strong, weak = np.where(swap, second, first), np.where(swap, first, second)
    apart = np.linalg.norm(blobs.position[strong] - blobs.position[weak], axis=1)
    ratio = blobs.radius[strong] / blobs.radius[weak]
    strongest[weak[(apart < blobs.radius[strong]) & (ratio < _PART) & (ratio > 1.0 / _PART)]] = False
    blobs = blobs.select(strongest)
    size, strength = np.log(blobs.radius), np.log(blobs.strength)
    alike = np.abs(strength[:, None] - strength) < math.log(_STRENGTHS)
    alike &= np.abs(size[:, None] - size) < math.log(_SIZES)
    field = blobs.select(alike[int((alike @ (blobs.strength * blobs.radius)).argmax())])
    if len(field.strength) < _FEWEST:
        return field
    tree = cKDTree(field.position)
    spacing = float(np.median(tree.query(field.position, k=2)[0][:, 1]))
    labels = connected_components(tree.sparse_distance_matrix(tree, _GAP * spacing).tocsr(), directed=False)[1]
    field = field.select(labels == np.bincount(labels, field.strength).argmax())
    # A reflection on a marker hides how large it is; of the field's size it is as strong as the others.
    radius, typical = float(np.median(field.radius)), float(np.median(field.strength))
    blobs = blobs_of(image, radius, polarity, typical / _STRENGTHS)
    apart, usual = cKDTree(field.position).query(blobs.position)[0], blobs.strength / typical
    near = (apart < 0.5 * radius) | ((apart < _WITHIN * spacing) & (usual > _AS_STRONG) & (usual < _STRENGTHS))
    return blobs.select(near).inside(mask)
