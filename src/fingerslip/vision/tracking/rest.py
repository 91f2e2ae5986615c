"""What rests in tracks: the first frames, and reflections that are taken for markers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.vision.tracking.layouts import expected_displacement, nearest_neighbours

Floats = NDArray[np.float64]

FEWEST = 5  # frames and markers without which there is no rest and no pattern
# Rest ends where markers leave it by so many times their noise, and by this share of the distance between them.
STIRRED, _STIR = 3.0, 0.02
# Neighbours have to move by so many pixels, and a reflection moves by less than this share of what they do. On four
# real clips markers at the clamped rim move by half as much as their neighbours and more.
_MOVING, _STILL = 3.0, 0.4
_LARGEST = 90  # percentile of the displacements in all frames: a few wrong ones do not count


def rest_length(position: Floats) -> int:
    """Return in how many of the first frames the markers (n_frames, n_markers, 2) rest, as they do in five or more."""
    at_rest: Floats = np.ma.masked_invalid(position[:FEWEST]).mean(axis=0).filled(np.nan)
    is_seen = np.isfinite(at_rest).all(axis=1)
    if len(position) <= FEWEST or is_seen.sum() < FEWEST:
        return len(position)
    spacing = float(np.median(nearest_neighbours(at_rest[is_seen])[1]))
    stirred = np.sqrt(np.ma.masked_invalid(((position - at_rest) ** 2).sum(axis=2)).mean(axis=1))
    limit = max(STIRRED * float(stirred[:FEWEST].mean()), _STIR * spacing)
    later = np.flatnonzero((stirred[FEWEST:] > limit).filled(False))
    return max(FEWEST, FEWEST + int(later[0]) - 2) if later.size else len(position)


def still_markers(position: Floats) -> NDArray[np.bool_]:
    """Tell which markers do not move with their neighbours, as reflections on the rim and dirt on the lens do.

    Motion counts from where they rest, however many frames the reference of the tracks has. Arrays: position
    (n_frames, n_markers, 2) [px]; returns (n_markers,).
    """
    reference: Floats = np.ma.masked_invalid(position[: rest_length(position)]).mean(axis=0).filled(np.nan)
    still = np.zeros(len(reference), dtype=bool)
    seen_at_rest = np.isfinite(reference).all(axis=1)
    displacement = position - reference
    moved = _largest(displacement)
    while True:
        # Reflections have reflections beside them, so those that are found are neighbours no more.
        chosen = np.flatnonzero(seen_at_rest & ~still)
        if len(chosen) < FEWEST:
            return still
        neighbours = nearest_neighbours(reference[chosen])[0]
        frames = displacement[:, chosen]
        expected = [expected_displacement(each, np.isfinite(each).all(axis=1), neighbours)[0] for each in frames]
        of_neighbours = _largest(np.stack(expected))
        found = (of_neighbours > _MOVING) & (moved[chosen] < _STILL * of_neighbours)
        if not found.any():
            return still
        still[chosen[found]] = True


def _largest(displacement: Floats) -> Floats:
    """Return how far displacements (n_frames, n, 2) go in all but a few frames, (n,)."""
    lengths = np.linalg.norm(displacement, axis=2)
    seen = np.isfinite(lengths).any(axis=0)
    largest = np.zeros(len(seen))
    largest[seen] = np.nanpercentile(lengths[:, seen], _LARGEST, axis=0)
    return largest
