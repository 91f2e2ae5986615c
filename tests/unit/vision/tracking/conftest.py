"""A short clip whose truth is known, and its tracks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from fingerslip.vision.tracking.track import track_markers
from problems import clips

REST, RATE = 10, 60.0


@dataclass(frozen=True)
class Clip:
    frames: list[NDArray[np.uint8]]
    truth: NDArray[np.float64]
    tracks: xr.Dataset


def tracked(positions: NDArray[np.float64], look: clips.Look = clips.DEFAULT, **options) -> Clip:
    seed, hidden = options.pop("seed", 0), options.pop("hidden", None)
    frames = list(clips.filmed(positions, look, seed=seed, hidden=hidden))
    tracks = track_markers(frames, frame_rate=RATE, **{"rest_frames": REST, "n_markers": positions.shape[1], **options})
    return Clip(frames, clips.truth_of(positions, look), tracks)


@pytest.fixture(scope="session")
def clip() -> Clip:
    """Return a slide of 81 markers by 40 px, in 40 frames."""
    return tracked(clips.slide(clips.field(), 0.7, count=40, rest=REST))
