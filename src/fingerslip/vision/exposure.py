"""What is wrong with a frame as a whole: dark, overexposed, or the same as the one before."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["DARK", "DUPLICATED", "FINE", "OVEREXPOSED", "STATES", "Exposure", "frame_state", "rest_exposure"]

FINE, DARK, OVEREXPOSED, DUPLICATED = range(4)
#: States of a frame by their number.
STATES = ("fine", "dark", "overexposed", "duplicated")

Frame = NDArray[np.uint8]

_EVERY = 8  # a frame is judged by every eighth pixel of every eighth row
_SATURATED = 250
_DARK_SHARE = 0.25
_DARKEST = 4.0  # grey levels
_SATURATED_MORE = 0.4


@dataclass(frozen=True)
class Exposure:
    """How bright the rest frames are."""

    mean: float  # mean grey level
    saturated: float  # share of pixels that are saturated


def rest_exposure(frame: Frame) -> Exposure:
    """Return how bright a frame is."""
    few = frame[::_EVERY, ::_EVERY]
    return Exposure(float(few.mean()), float((few >= _SATURATED).mean()))


def frame_state(frame: Frame, before: Frame | None, rest: Exposure) -> int:
    """Return the state of a frame: `FINE`, `DARK`, `OVEREXPOSED` or `DUPLICATED`.

    Dark is below a quarter of the mean level at rest, overexposed where two fifths more of the pixels are saturated
    than at rest, duplicated where no pixel differs from the frame before.
    """
    now = rest_exposure(frame)
    if now.mean < max(_DARK_SHARE * rest.mean, _DARKEST):
        return DARK
    if now.saturated > rest.saturated + _SATURATED_MORE:
        return OVEREXPOSED
    if before is not None and frame.shape == before.shape and _same(frame, before):
        return DUPLICATED
    return FINE


def _same(frame: Frame, before: Frame) -> bool:
    # A few pixels settle it nearly always.
    few = np.array_equal(frame[::_EVERY, ::_EVERY], before[::_EVERY, ::_EVERY])
    return few and np.array_equal(frame, before)
