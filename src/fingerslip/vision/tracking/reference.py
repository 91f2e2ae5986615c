"""The markers of a video, found in the mean of its first frames."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.tracking.blobs import field_of
from fingerslip.vision.tracking.layouts import LayoutName, layout_of, misfits, topology
from fingerslip.vision.tracking.markers import Markers, known_markers

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Quality of a marker, and of one that is of the same kind in shares of the median.
_LEAST_QUALITY, _LIKENESS = 0.6, 0.8
_CLOSEST = 0.45  # of two blobs that are nearer, in distances between markers, one is a reflection
_ODD = 0.1  # share of the blobs that may be no markers, by the layout of the others
_LEAST_SHARE = 0.8  # of the markers; with fewer there is no tracking
_FEWEST = 10  # blobs that may be a sensor's markers where nobody says how many there are
# Contrast over noise, both summed over the pixels of a marker: the largest of pure noise is about 5.
_LEAST_RATIO = 8.0
_DARK, _BRIGHT = 6.0, 245.0  # grey levels
_REPAIR = "give the number of markers, whether they are bright, or a mask of where they are"


@dataclass(frozen=True)
class Reference:
    """The markers at rest, numbered."""

    markers: Markers  # what is known of them, in the order of their numbers
    layout: str  # how they are arranged
    ring: NDArray[np.intp] | None  # (n,), ring of each
    angle: Floats | None  # (n,), angle of each around the centre [rad]
    warnings: tuple[str, ...]  # what is not as it should be


def reference_of(  # noqa: PLR0917  the options of a search
    image: Floats, mask: Flags | None, n_markers: int | None, layout: LayoutName, bright: bool | None, name: str
) -> Reference:
    """Find, measure and number the markers of the mean of the first frames.

    Arrays: image (height, width) [grey levels]; mask (height, width).
    """
    markers = _best(image, mask, bright)
    if markers is not None:
        layout = layout_of(markers.position) if layout == "auto" else layout
        odd = misfits(markers.position, layout)
        markers = markers.select(np.flatnonzero(~odd)) if odd.mean() <= _ODD else markers
        markers = markers.select(np.flatnonzero(~_too_near(markers, _CLOSEST * float(np.median(markers.spacing)))))
        if layout == "free" and n_markers is None:
            # Neither a layout nor a number says which of the blobs are markers.
            markers = markers.select(np.flatnonzero(_same_kind(markers)))
    count = 0 if markers is None else len(markers.position)
    if markers is None or count < (_LEAST_SHARE * n_markers if n_markers else _FEWEST):
        level = float(image.mean())
        light = "dark " if level < _DARK else "overexposed " if level > _BRIGHT else ""
        fault = f"found {count or 'no'} markers in the {light}first frames, of mean grey level {level:.0f} of 255"
        blobs = f"at least {_FEWEST} blobs that are alike and stand out of what is around them"
        raise InputError(name, fault, f"needs {n_markers or blobs}", _REPAIR)
    warnings = []
    if n_markers is not None and count > n_markers:
        alike = int(_same_kind(markers).sum())
        if alike > n_markers:
            repair = f"give n_markers {alike} or none (--markers) for all, or a mask of those that are meant"
            fault = f"asked for {n_markers} markers, found {alike} of the same kind in the first frames"
            warnings.append(f"{name}: {fault}; {repair}")
        markers = markers.select(np.argsort(-markers.quality, kind="stable")[:n_markers])
    elif n_markers is not None and count < n_markers:
        warnings.append(f"found {count} of {n_markers} markers in the first frames")
    numbered = topology(markers.position, layout)
    warnings += [numbered.complaint] if numbered.complaint else []
    ordered = markers.select(numbered.order)
    return Reference(ordered, numbered.layout, numbered.ring, numbered.angle, tuple(warnings))


def _best(image: Floats, mask: Flags | None, bright: bool | None) -> Markers | None:
    """Return the markers of the polarity that has the stronger field, none where it is no more than noise."""
    polarities = (1.0, -1.0) if bright is None else (1.0 if bright else -1.0,)
    fields = {polarity: field_of(image, mask, polarity) for polarity in polarities}
    polarity = max(fields, key=lambda key: float(fields[key].strength.sum()))
    blobs = fields[polarity]
    if not len(blobs.strength):
        return None
    radius = float(np.median(blobs.radius))
    markers = known_markers(image, mask, blobs, polarity)
    near = np.linalg.norm(markers.position - blobs.position, axis=1) < radius
    twice = _too_near(markers, 0.8 * radius)
    markers = markers.select(np.flatnonzero((markers.quality >= _LEAST_QUALITY) & near & ~twice))
    noise = float(np.median(np.abs(np.diff(image, axis=1)))) / (0.6745 * math.sqrt(2.0))
    pixels = math.sqrt(math.pi) * radius
    if not len(markers.position) or float(np.median(markers.amplitude)) * pixels <= _LEAST_RATIO * noise:
        return None
    return markers


def _too_near(markers: Markers, distance: float) -> Flags:
    """Tell which markers (n,) have a stronger one nearer than a distance [px]."""
    apart = np.linalg.norm(markers.position[:, None] - markers.position[None], axis=2)
    rank = np.argsort(np.argsort(-markers.strength, kind="stable"))
    return np.asarray(((apart < distance) & (rank[None] < rank[:, None])).any(axis=1))


def _same_kind(markers: Markers) -> Flags:
    return np.asarray(markers.quality > _LIKENESS * np.median(markers.quality))
