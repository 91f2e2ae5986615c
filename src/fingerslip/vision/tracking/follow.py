"""A step of the tracker: from the markers of one frame to those of the next.

Each marker is measured where it should be, at constant velocity. What fails there is measured where optical flow has it
(pyramidal Lucas-Kanade). Where many are lost at once the whole pattern may have leapt, and they are measured where it
is. What fails again, or was lost before, is searched for around the place that its neighbours point to; candidates and
searched markers are then matched one to one. A marker counts only where it looks like itself and moved as its
neighbours did.
"""

from __future__ import annotations

import dataclasses
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
# Where a marker is searched for, from the place where it is expected, in shares of its window.
_ANGLES = np.arange(6) * np.pi / 3.0
_AROUND = np.vstack([[[0.0, 0.0]], 0.9 * np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])])


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
    seen = np.zeros(len(nothing), dtype=np.intp)
    return State(markers.position.copy(), nothing, nothing.copy(), markers.amplitude.copy(), seen, None)


def follow(markers: Markers, state: State, image: Frame, mask: Flags | None) -> tuple[State, Floats, Floats]:
    """Find all markers in the next frame; return the new state, positions (n, 2) [px] and qualities (n,).

    Markers that are not found have the position NaN and the quality 0. Image and mask are (height, width).
    """
    step, here, before = _Step(markers, state, image, mask), state.missing == 0, state.image
    measured, right = step.look(np.where(here[:, None], state.position + state.velocity, np.nan))
    sure = step.agree(measured, right)
    if before is not None and (here & ~sure).any():
        tried = np.flatnonzero(here & ~sure)
        guess = np.full_like(state.position, np.nan)
        guess[tried] = _flow(before, image, state.position[tried])
        again, right = step.look(guess)
        measured = _merge(measured, again, right)
        sure = step.agree(measured, sure | right)
    if before is not None and lost_suddenly(here, sure):
        radius = float(np.median(markers.radius))
        shift = common_shift(before, image, state.position[here], radius, markers.polarity)
        again, right = step.look(np.where(here[:, None], state.position + shift, np.nan))
        agreed = step.agree(again, right)
        measured, sure = (again, agreed) if agreed.sum() > sure.sum() else (measured, sure)
    if not sure.all():
        measured, sure = step.search(measured, sure)
    return step.update(measured, sure)


@dataclass(frozen=True)
class _Step:
    """What is known when a frame is looked at."""

    markers: Markers
    state: State
    image: Frame
    mask: Flags | None

    def look(self, guess: Floats) -> tuple[Measured, Flags]:
        """Measure markers where they are expected (n, 2) [px], and tell which were seen themselves, near enough."""
        measured = measure(self.markers, self.image, self.mask, guess)
        right = (measured.quality >= _LEAST_QUALITY) & _has_contrast(measured, self.state.amplitude)
        right &= np.linalg.norm(measured.position - guess, axis=1) <= _REACH * self.markers.spacing
        return measured, right

    def agree(self, measured: Measured, sure: Flags) -> Flags:
        """Tell which markers moved as their neighbours did since they were seen; see `State.carried`."""
        rest, spacing, neighbours = self.markers.position, self.markers.spacing, self.markers.neighbours
        share = np.minimum(_STRANGE * (1.0 + _FORGETTING * self.state.missing), _STRANGEST)
        displacement = measured.position - rest
        near = consistent(rest, displacement - self.state.carried, sure, neighbours, share * spacing)
        return consistent(rest, displacement, near, neighbours, _STRANGEST * spacing)

    def neighbours_step(self, measured: Measured, sure: Flags) -> Floats:
        """Return how the neighbours of each marker moved since the last frame (n, 2) [px]; 0 where none is sure."""
        rest = self.markers.position
        step = np.where(sure[:, None], measured.position - rest - self.state.carried, 0.0)
        moved, counts = expected_displacement(rest, step, sure, self.markers.neighbours)
        return np.where((counts > 0)[:, None], moved, 0.0)

    def search(self, measured: Measured, sure: Flags) -> tuple[Measured, Flags]:
        """Search around the places that neighbours point to for what is not sure, and match it with what is there."""
        markers, wanted = self.markers, np.flatnonzero(~sure)
        expected = (markers.position + self.state.carried + self.neighbours_step(measured, sure))[wanted]
        # At each expected place and six around it.
        owners = np.repeat(wanted, len(_AROUND))
        starts = (expected[:, None] + markers.window[wanted][:, None, None] * _AROUND).reshape(-1, 2)
        seen = measure(markers, self.image, self.mask, starts, owners)
        free = np.isfinite(seen.position[:, 0])
        if sure.any():
            apart = np.linalg.norm(seen.position[:, None] - measured.position[sure][None], axis=2)
            free &= apart.min(axis=1) > markers.radius[owners]
        usable = free & (seen.quality >= _LEAST_AGAIN) & _has_contrast(seen, self.state.amplitude[owners])
        if not usable.any():
            return measured, sure
        candidates = np.flatnonzero(usable)
        reach = _REACH * markers.spacing[wanted]
        rows, columns = assign(expected, reach, seen.position[candidates], seen.quality[candidates])
        used, chosen = wanted[rows], candidates[columns]
        position, amplitude, quality = (
            array.copy() for array in (measured.position, measured.amplitude, measured.quality)
        )
        position[used], amplitude[used] = seen.position[chosen], seen.amplitude[chosen]
        quality[used] = _FOUND_AGAIN * seen.quality[chosen]
        now_sure = sure.copy()
        now_sure[used] = True
        again = Measured(position, amplitude, quality)
        return again, self.agree(again, now_sure)

    def update(self, measured: Measured, sure: Flags) -> tuple[State, Floats, Floats]:
        """Return the state after the frame, and what was found."""
        state, missing = self.state, ~sure[:, None]
        position = np.where(missing, np.nan, measured.position)
        quality = np.where(sure, np.clip(measured.quality, 0.0, 1.0), 0.0)
        if not sure.any():
            return dataclasses.replace(state, velocity=np.zeros_like(state.velocity)), position, quality
        step = self.neighbours_step(measured, sure)
        surprise = np.where(missing, 0.0, measured.position - self.markers.position - state.carried - step)
        # A marker's own way counts little where it may be a reflection that stands still.
        trust = np.clip((quality - _LEAST_AGAIN) / (_TRUSTED - _LEAST_AGAIN), _LEAST_TRUST, 1.0)
        adapted = state.amplitude + _ADAPTION * (measured.amplitude - state.amplitude)
        steady = sure & (state.missing == 0)
        new = State(
            position=np.where(missing, state.position, measured.position),
            velocity=np.where(steady[:, None], measured.position - state.position, 0.0),
            carried=state.carried + step + trust[:, None] * surprise,
            amplitude=np.where(sure, adapted, state.amplitude),
            missing=np.where(sure, 0, state.missing + 1),
            image=self.image,
        )
        return new, position, quality


def _has_contrast(measured: Measured, amplitude: Floats) -> Flags:
    contrast = measured.amplitude / amplitude
    return (contrast > _CONTRAST[0]) & (contrast < _CONTRAST[1])


def _flow(before: Frame, image: Frame, points: Floats) -> Floats:
    """Return where points (n, 2) [px] of one frame are in the next, NaN where that is not known."""
    moved, status, _ = opencv().calcOpticalFlowPyrLK(
        before,
        image,
        points.astype(np.float32)[:, None],
        None,
        winSize=(_FLOW_WINDOW, _FLOW_WINDOW),
        maxLevel=_FLOW_LEVELS,
    )
    flown: Floats = np.where(status == 1, moved.reshape(-1, 2), np.nan).astype(np.float64)
    return flown


def _merge(measured: Measured, again: Measured, used: Flags) -> Measured:
    """Return measurements, of some markers those that were made again."""
    return Measured(
        np.where(used[:, None], again.position, measured.position),
        np.where(used, again.amplitude, measured.amplitude),
        np.where(used, again.quality, measured.quality),
    )
