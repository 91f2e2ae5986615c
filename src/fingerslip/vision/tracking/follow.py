"""A step of the tracker: from the markers of one frame to those of the next.

Each marker is measured where it should be, at constant velocity. What fails there is measured where optical flow has it
(pyramidal Lucas-Kanade). Where many are lost at once the whole pattern may have leapt, and they are measured where it
is. What fails again, or was lost before, is searched for around the place that its neighbours point to; candidates and
searched markers are then matched one to one. A marker counts only where it looks like itself and moved as its
neighbours did.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.vision.tracking.markers import Markers, Measured, measure
from fingerslip.vision.tracking.neighbours import assign, common_shift, consistent, expected_displacement, lost_suddenly
from fingerslip.vision.video import opencv

__all__ = ["State", "follow", "rest_state"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Frame = NDArray[np.uint8]

# What a marker needs to count: quality, and contrast in shares of its own.
_LEAST_QUALITY = 0.5
_LEAST_AGAIN = 0.6  # after it was lost
_CONTRAST = (0.25, 4.0)
# How far from a guess a marker may be found, in distances between neighbours.
_REACH = 0.45
# How far the displacement of a marker may leave its neighbours' from one frame to the next, in the same distances; it
# grows by a fifth for each frame in which the marker was not seen, up to the largest. The largest also holds since the
# rest frames: ridges and slip move neighbours apart.
_STRANGE, _FORGETTING, _STRANGEST = 0.5, 0.2, 1.0
# What a new frame adds to the memory of a marker's contrast.
_ADAPTION = 0.05
# Quality from which on a marker's own motion beside its neighbours' is believed at once; below it, more slowly.
_TRUSTED, _LEAST_TRUST = 0.9, 0.05
_FOUND_AGAIN = 0.5  # the quality of the first sight counts half
_FLOW_WINDOW, _FLOW_LEVELS = 31, 4


@dataclass(frozen=True)
class State:
    """What the tracker remembers between frames."""

    position: Floats  # (n, 2), where each marker was last seen [px]
    velocity: Floats  # (n, 2), its last displacement between two frames [px], 0 where it is not known
    carried: Floats  # (n, 2), its displacement since rest [px]
    amplitude: Floats  # (n,), its contrast [grey levels], following slow changes of the light
    missing: NDArray[np.intp]  # (n,), frames since it was last seen
    image: Frame | None  # (height, width), the frame in which the markers with ``missing == 0`` were seen


def rest_state(markers: Markers) -> State:
    """Return the state before the first frame."""
    nothing = np.zeros_like(markers.position)
    return State(
        markers.position.copy(),
        nothing,
        nothing.copy(),
        markers.amplitude.copy(),
        np.zeros(len(nothing), dtype=np.intp),
        None,
    )


def follow(markers: Markers, state: State, image: Frame, mask: Flags | None) -> tuple[State, Floats, Floats]:
    """Find all markers in the next frame.

    Parameters
    ----------
    markers : Markers
        What is known of them.
    state : State
        What the tracker remembers.
    image : (height, width) array of uint8
        The frame.
    mask : (height, width) array of bool or None
        Pixels that count.

    Returns
    -------
    State, (n, 2) array, (n,) array
        The new state; positions [px], NaN where a marker was not found; qualities, 0 there.
    """
    here = state.missing == 0
    guess = np.where(here[:, None], state.position + state.velocity, np.nan)
    measured = measure(markers, image, mask, guess)
    sure = _find_agreement(markers, state, measured, _looks_right(markers, state, measured, guess, _LEAST_QUALITY))
    if state.image is not None and (here & ~sure).any():
        measured, sure = _by_flow(markers, state, image, mask, measured, sure)
    if state.image is not None and lost_suddenly(here, sure):
        measured, sure = _by_leap(markers, state, image, mask, measured, sure)
    if not sure.all():
        measured, sure = _search(markers, state, image, mask, measured, sure)
    return _update(markers, state, image, measured, sure)


def _looks_right(markers: Markers, state: State, measured: Measured, guess: Floats, least: float) -> Flags:
    """Tell which measurements show the marker itself, near enough to where it was expected."""
    contrast = measured.amplitude / state.amplitude
    apart = np.linalg.norm(measured.position - guess, axis=1)
    right: Flags = (measured.quality >= least) & (contrast > _CONTRAST[0]) & (contrast < _CONTRAST[1])
    right &= apart <= _REACH * markers.spacing
    return right


def _find_agreement(markers: Markers, state: State, measured: Measured, sure: Flags) -> Flags:
    """Tell which markers moved as their neighbours did since they were seen; see `State.carried`."""
    share = np.minimum(_STRANGE * (1.0 + _FORGETTING * state.missing), _STRANGEST)
    displacement = measured.position - markers.position
    near = consistent(markers.position, displacement - state.carried, sure, markers.neighbours, share * markers.spacing)
    return consistent(markers.position, displacement, near, markers.neighbours, _STRANGEST * markers.spacing)


def _by_flow(  # noqa: PLR0917  a step of follow
    markers: Markers, state: State, image: Frame, mask: Flags | None, measured: Measured, sure: Flags
) -> tuple[Measured, Flags]:
    """Measure again, where optical flow says, what was seen in the last frame and is not sure now."""
    tried = np.flatnonzero((state.missing == 0) & ~sure)
    moved = _flow(state.image, image, state.position[tried])
    guess = np.full_like(measured.position, np.nan)
    guess[tried] = moved
    again = measure(markers, image, mask, guess)
    right = _looks_right(markers, state, again, guess, _LEAST_QUALITY)
    merged = _merge(measured, again, right)
    return merged, _find_agreement(markers, state, merged, sure | right)


def _by_leap(  # noqa: PLR0917  a step of follow
    markers: Markers, state: State, image: Frame, mask: Flags | None, measured: Measured, sure: Flags
) -> tuple[Measured, Flags]:
    """Measure all markers again where the pattern as a whole says, if more of them are found there."""
    here = state.missing == 0
    points, radius = state.position[here], float(np.median(markers.radius))
    shift = common_shift(_image(state), image, points, radius, markers.polarity)
    guess = np.where(here[:, None], state.position + shift, np.nan)
    again = measure(markers, image, mask, guess)
    right = _looks_right(markers, state, again, guess, _LEAST_QUALITY)
    agreed = _find_agreement(markers, state, again, right)
    return (again, agreed) if agreed.sum() > sure.sum() else (measured, sure)


def _image(state: State) -> Frame:
    assert state.image is not None  # there was a frame before
    return state.image


def _flow(before: Frame | None, image: Frame, points: Floats) -> Floats:
    """Return where points of one frame are in the next, NaN where that is not known."""
    start = points.astype(np.float32).reshape(-1, 1, 2)
    moved, status, _ = opencv().calcOpticalFlowPyrLK(
        before, image, start, None, winSize=(_FLOW_WINDOW, _FLOW_WINDOW), maxLevel=_FLOW_LEVELS
    )
    flown: Floats = np.where(status == 1, moved.reshape(-1, 2), np.nan).astype(np.float64)
    return flown


def _merge(measured: Measured, again: Measured, used: Flags) -> Measured:
    return Measured(
        np.where(used[:, None], again.position, measured.position),
        np.where(used, again.amplitude, measured.amplitude),
        np.where(used, again.quality, measured.quality),
    )


def _search(  # noqa: PLR0917  a step of follow
    markers: Markers, state: State, image: Frame, mask: Flags | None, measured: Measured, sure: Flags
) -> tuple[Measured, Flags]:
    """Search around the expected places for all that is not sure, and match it one to one with what is there."""
    expected = _expected_places(markers, state, measured, sure)
    wanted = np.flatnonzero(~sure)
    starts, owners = _starts(expected[wanted], wanted, markers.window)
    seen = measure(markers, image, mask, starts, owners)
    free = _free(seen.position, measured.position[sure], markers.radius[owners])
    contrast = seen.amplitude / state.amplitude[owners]
    usable = free & (seen.quality >= _LEAST_AGAIN) & (contrast > _CONTRAST[0]) & (contrast < _CONTRAST[1])
    if not usable.any():
        return measured, sure
    candidates = np.flatnonzero(usable)
    rows, columns = assign(
        expected[wanted], _REACH * markers.spacing[wanted], seen.position[candidates], seen.quality[candidates]
    )
    used = np.zeros(len(sure), dtype=bool)
    used[wanted[rows]] = True
    again = Measured(measured.position.copy(), measured.amplitude.copy(), measured.quality.copy())
    chosen = candidates[columns]
    again.position[wanted[rows]] = seen.position[chosen]
    again.amplitude[wanted[rows]] = seen.amplitude[chosen]
    again.quality[wanted[rows]] = _FOUND_AGAIN * seen.quality[chosen]
    return again, _find_agreement(markers, state, again, sure | used)


def _expected_places(markers: Markers, state: State, measured: Measured, sure: Flags) -> Floats:
    """Return where the neighbours say that each marker is; where none is sure, where it was carried to."""
    return markers.position + state.carried + _neighbours_step(markers, state, measured, sure)


def _neighbours_step(markers: Markers, state: State, measured: Measured, sure: Flags) -> Floats:
    """Return how the neighbours of each marker moved since the last frame [px]; 0 where none is sure."""
    step = np.where(sure[:, None], measured.position - markers.position - state.carried, 0.0)
    moved, counts = expected_displacement(markers.position, step, sure, markers.neighbours)
    return np.where((counts > 0)[:, None], moved, 0.0)


def _starts(expected: Floats, wanted: NDArray[np.intp], window: Floats) -> tuple[Floats, NDArray[np.intp]]:
    """Return where to look: at each expected place and six around it."""
    angles = np.arange(6) * np.pi / 3.0
    around = np.vstack([[[0.0, 0.0]], 0.9 * np.column_stack([np.cos(angles), np.sin(angles)])])
    starts = expected[:, None] + window[wanted][:, None, None] * around
    return starts.reshape(-1, 2), np.repeat(wanted, len(around))


def _free(positions: Floats, others: Floats, radius: Floats) -> Flags:
    """Tell which positions are not those of markers that are sure."""
    visible = np.isfinite(positions[:, 0])
    if not len(others):
        return visible
    apart = np.linalg.norm(positions[:, None] - others[None], axis=2).min(axis=1)
    free: Flags = visible & (apart > radius)
    return free


def _trust(quality: Floats) -> Floats:
    """Return how much a marker's own way counts: little where it may be a reflection that stands still."""
    trust: Floats = np.clip((quality - _LEAST_AGAIN) / (_TRUSTED - _LEAST_AGAIN), _LEAST_TRUST, 1.0)
    return trust


def _update(
    markers: Markers, state: State, image: Frame, measured: Measured, sure: Flags
) -> tuple[State, Floats, Floats]:
    """Return the state after a frame, and what was found."""
    position = np.where(sure[:, None], measured.position, np.nan)
    quality = np.where(sure, np.clip(measured.quality, 0.0, 1.0), 0.0)
    if not sure.any():
        lost_state = State(
            state.position, np.zeros_like(state.velocity), state.carried, state.amplitude, state.missing, state.image
        )
        return lost_state, position, quality
    steady = sure & (state.missing == 0)
    velocity = np.where(steady[:, None], measured.position - state.position, 0.0)
    step = _neighbours_step(markers, state, measured, sure)
    surprise = np.where(sure[:, None], measured.position - markers.position - state.carried - step, 0.0)
    adapted = state.amplitude + _ADAPTION * (measured.amplitude - state.amplitude)
    new = State(
        np.where(sure[:, None], measured.position, state.position),
        velocity,
        state.carried + step + _trust(quality)[:, None] * surprise,
        np.where(sure, adapted, state.amplitude),
        np.where(sure, 0, state.missing + 1),
        image,
    )
    return new, position, quality
