"""A step of the tracker: from the markers of one frame to those of the next.

Blobs of the markers' size are found in the frame. Each marker is expected where optical flow has its neighbours
(pyramidal Lucas-Kanade, the median of them), and blobs and expected places are matched one to one. The same is tried
with the places at rest, and where many markers are lost with the one shift at which most have a blob; of these the
match is taken that explains most. A marker that goes on step by step is kept. One that does not, and whose
displacement leaves that of its neighbours, is dropped, and carried along by them until it has a blob again. What is
lost from one frame to the next may have slipped alone (see `leaps`). Each match is measured below the pixel by a fit of
the marker's own profile.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from fingerslip.arrays import Flags, Floats
from fingerslip.vision.tracking.blobs import Blobs, blobs_of, reduced_to
from fingerslip.vision.tracking.layouts import assign, common_shift, consistent, expected_displacement
from fingerslip.vision.tracking.leaps import Match, State, rematch, untangle
from fingerslip.vision.tracking.markers import Markers, Measured, measure
from fingerslip.vision.video import Frame, opencv

# How far from its expected place a blob may be, and a displacement from its neighbours', in distances of neighbours.
_REACH, _STRANGE = 0.45, 0.6
# A marker farther than the first from where its neighbours expect it is taken back to a free blob within the second.
_OWN_WAY, _BACK = 0.25, 0.2
# Blobs of a smaller share of the markers' strength are none.
_FAINT = 0.3
_LEAST_QUALITY = 0.5
# Without a blob a marker needs a better fit, a contrast within this logarithm of its own, and a place so near.
_LEAST_AGAIN, _CONTRAST, _NEAR = 0.75, 1.0, 0.25
_SAME_CONTRAST = 0.4  # the same of a marker that leaps out of reach
# A blob within this logarithm of the markers' strength, and so near, in distances between them, may be another one.
_USUAL, _BESIDE = 0.3, 1.25
_OF_BLOBS = 0.3  # quality of a marker whose blob is seen, but no profile in it that is its own
_LOST = 0.1  # share of the markers that are lost or far from where they were expected where all may have leapt
_ADAPTION = 0.05  # what a frame adds to the memory of the light
_MARGIN = 2.0  # distances between neighbours around the markers that are looked at
_FLOW_WINDOW, _FLOW_LEVELS = 21, 4


def rest_state(markers: Markers) -> State:
    """Return the state before the first frame."""
    return State(markers.position.copy(), np.ones(len(markers.position), dtype=bool), 1.0, None, markers.position)


def follow(markers: Markers, state: State, image: Frame, mask: Flags | None) -> tuple[State, Floats, Floats]:
    """Find all markers in the next frame; return the new state, positions (n, 2) [px] and qualities (n,).

    Markers that are not found have the position NaN and the quality 0. Image and mask are (height, width).
    """
    rest, spacing = markers.position, float(np.median(markers.spacing))
    window = _around(np.vstack([rest, state.position]), _MARGIN * min(spacing, 0.25 * max(image.shape)), image.shape)
    least = _FAINT * state.light * float(np.median(markers.strength))
    blobs = blobs_of(image[window], markers.size, markers.polarity, least)
    blobs = dataclasses.replace(blobs, position=blobs.position + _corner(window)).inside(mask)
    if not len(blobs.strength):
        return dataclasses.replace(state, visible=0), np.full_like(rest, np.nan), np.zeros(len(rest))
    match = _match(markers, state, _flown(markers, state, image, window), blobs)
    if not match.sure.any():
        return dataclasses.replace(state, visible=0), np.full_like(rest, np.nan), np.zeros(len(rest))
    match = untangle(markers, state.position, rematch(markers, state, image, blobs, match))
    position, sure, used = match.position, match.sure, match.used
    expected, _ = expected_displacement(position - rest, sure, markers.neighbours)
    expected = np.where(np.isfinite(expected), rest + expected, position)
    position = np.where(sure[:, None], position, expected)
    measured = measure(markers, image, mask, position)
    fits = _fits(markers, state, measured, position, sure) & ~match.shares
    far = sure & (np.linalg.norm(position - match.guess, axis=1) > _REACH * markers.spacing)
    # What leaps out of reach has to look like itself there, and what leaps onto another marker to be there again.
    leaps = far & ~match.shares & (np.linalg.norm(position - expected, axis=1) > _BACK * markers.spacing)
    leaps &= ~fits | (_contrast(markers, state, measured) > _SAME_CONTRAST)
    sure, seen = sure & ~leaps, (sure | fits) & ~leaps
    exact = np.where(leaps[:, None], match.guess, np.where(fits[:, None], measured.position, position))
    fits &= seen
    strength = np.median(blobs.strength[used[sure]] / markers.strength[sure]) if sure.any() else state.light
    quality = np.where(fits, np.clip(measured.quality, 0.0, 1.0), np.where(sure, _OF_BLOBS, 0.0))
    free = blobs.select(np.delete(np.arange(len(blobs.strength)), used[sure]))
    # Blobs that no marker has, but look like one and are among or beside those seen, are visible too.
    apart = cKDTree(exact[seen]).query(free.position)[0]
    alike = np.abs(np.log(free.strength / (float(np.median(markers.strength)) * state.light))) < _USUAL
    visible = int(seen.sum() + (alike & (apart > markers.size) & (apart < _BESIDE * spacing)).sum())
    new = State(exact, seen, state.light + _ADAPTION * (float(strength) - state.light), image, blobs.position, visible)
    # The first sight of a marker that was lost counts half.
    shown = seen & ~(far & match.shares)
    return new, np.where(shown[:, None], exact, np.nan), np.where(shown, np.where(state.seen, 1.0, 0.5) * quality, 0.0)


def _fits(markers: Markers, state: State, measured: Measured, position: Floats, sure: Flags) -> Flags:
    """Tell which markers look like themselves where they are expected (n, 2) [px]; without a blob more is asked."""
    apart = np.linalg.norm(measured.position - position, axis=1)
    fits = (measured.quality >= _LEAST_QUALITY) & (apart < 0.5 * markers.radius)
    alone = cdist(measured.position, position[sure]).min(axis=1) > markers.radius
    again = (measured.quality >= _LEAST_AGAIN) & (_contrast(markers, state, measured) < _CONTRAST)
    return np.asarray(np.where(sure, fits, again & alone & (apart < _NEAR * markers.spacing)))


def _contrast(markers: Markers, state: State, measured: Measured) -> Floats:
    """Return the logarithm of how much more or less contrast each marker has than at rest, (n,)."""
    share = measured.amplitude / (markers.amplitude * state.light)
    return np.asarray(np.abs(np.log(np.maximum(share, 1e-3))))


def _around(points: Floats, margin: float, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Return the rows and columns of an image that contain points (n, 2) [px] with a margin [px]."""
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    left, top = np.maximum(low, 0).astype(int).tolist()
    right, bottom = np.minimum(high + 1, shape[::-1]).astype(int).tolist()
    return slice(top, bottom), slice(left, right)


def _corner(window: tuple[slice, slice]) -> Floats:
    return np.array([window[1].start, window[0].start], dtype=np.float64)


def _flown(markers: Markers, state: State, image: Frame, window: tuple[slice, slice]) -> Floats:
    """Return where the neighbours' optical flow since the last frame takes each marker (n, 2) [px]."""
    if state.image is None:
        return state.position
    (before, shrink), (now, _) = (reduced_to(frame[window], markers.size) for frame in (state.image, image))
    start = ((state.position - _corner(window)) / shrink).astype(np.float32)
    size = (_FLOW_WINDOW, _FLOW_WINDOW)
    moved, status, _ = opencv().calcOpticalFlowPyrLK(
        before, now, start[:, None], None, winSize=size, maxLevel=_FLOW_LEVELS
    )
    step, is_right = (moved[:, 0] - start).astype(np.float64) * shrink, status[:, 0] == 1
    expected, _ = expected_displacement(step, is_right, markers.neighbours)
    alone = np.where(is_right[:, None], step, 0.0)
    return np.asarray(state.position + np.where(np.isfinite(expected), expected, alone))


def _match(markers: Markers, state: State, flown: Floats, blobs: Blobs) -> Match:
    """Return the match of blobs that explains most, of those by all guesses; `flown` (n, 2) is the first [px]."""
    best = _match_guess(markers, state, flown, flown, blobs)
    guesses = [markers.position]
    if best.explained < (1.0 - _LOST) * state.seen.sum():
        spacing = float(np.median(markers.spacing))
        guesses.append(state.position + common_shift(state.position, blobs.position, spacing))
    for guess in guesses:
        other = _match_guess(markers, state, guess, flown, blobs)
        best = other if other.explained > best.explained else best
    return best


def _match_guess(markers: Markers, state: State, guess: Floats, flown: Floats, blobs: Blobs) -> Match:
    """Return what `_match` does for a guess (n, 2) [px]."""
    rows, columns = assign(guess, _REACH * markers.spacing, blobs.position)
    position, used = guess.copy(), np.zeros(len(guess), dtype=np.intp)
    position[rows], used[rows] = blobs.position[columns], columns
    matched = np.zeros(len(guess), dtype=bool)
    matched[rows] = True
    # What goes on from where it was seen may go its own way.
    goes_on = matched & state.seen & (np.linalg.norm(position - flown, axis=1) < _OWN_WAY * markers.spacing)
    sure = goes_on | consistent(position - markers.position, matched, markers.neighbours, _STRANGE * markers.spacing)
    apart = np.linalg.norm(position - guess, axis=1) / markers.spacing
    explained = float(sure.sum() - apart[sure].sum())
    # What is lost, or went its own way, comes back to a blob that nobody has where its neighbours expect it.
    expected, _ = expected_displacement(position - markers.position, sure, markers.neighbours)
    expected += markers.position
    near = np.linalg.norm(position - expected, axis=1) < _OWN_WAY * markers.spacing
    astray = np.flatnonzero(~(sure & near) & np.isfinite(expected[:, 0]))
    free = np.setdiff1d(np.arange(len(blobs.strength)), used[sure])
    if astray.size and free.size:
        rows, columns = assign(expected[astray], _BACK * markers.spacing[astray], blobs.position[free])
        position[astray[rows]], used[astray[rows]] = blobs.position[free[columns]], free[columns]
        sure[astray[rows]] = True
    return Match(guess, position, sure, used, np.zeros_like(sure), explained)
