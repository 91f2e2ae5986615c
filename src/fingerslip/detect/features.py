"""What classifiers see of a frame: how the markers moved since rest, and sets of features of that motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Annotated

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats, Singles
from fingerslip.errors import InputError, shorten
from fingerslip.libraries import xr
from fingerslip.parameters import Number, parameters
from fingerslip.vision.fields import fit_rigid_motions, green_strain, marker_means, marker_triangles, triangle_gradients
from fingerslip.vision.tracks import check_size, seen


@parameters
class MotionSettings:
    """How motion is read from tracks."""

    # Frames at the start whose mean is the rest position, as in Cordova Bulens et al. 2023.
    rest_frames: pydantic.PositiveInt = 100
    # Frames through which the velocity is fitted, the newest included. The paper takes the difference of two frames,
    # its equation 2; at 0.3 mm/s markers move less in a frame than their noise, so that says little.
    window: Annotated[int, pydantic.Field(ge=2)] = 11
    # Share of the markers that a frame has to show to be classified; assumed.
    least_seen: Annotated[Number, pydantic.Field(gt=0, le=1)] = 0.5


@dataclass(frozen=True)
class Motion:
    """Markers over time."""

    time: Floats  # (n_times,) [s]
    rest: Floats  # (n_markers, 2), positions at rest, in the unit of the tracks
    displacement: Floats  # (n_times, n_markers, 2), since rest
    velocity: Floats  # (n_times, n_markers, 2), slope of the displacement over the last frames, per second
    ring: NDArray[np.intp]  # (n_markers,), ring of each marker, 0 in the centre
    seen: Flags  # (n_times, n_markers)
    usable: Flags  # (n_times,), frames in which enough of them were seen

    def at(self, frames: NDArray[np.intp] | slice) -> Motion:
        """Return some frames of it."""
        over_time = ("time", "displacement", "velocity", "seen", "usable")
        return replace(self, **{name: getattr(self, name)[frames] for name in over_time})


def markers_of(tracks: xr.Dataset, kind: str) -> xr.Dataset:
    """Return the markers of one kind, ``internal`` or ``external``, seen along the third axis."""
    chosen = np.flatnonzero(tracks["kind"].values.astype(str) == kind)
    if chosen.size == 0:
        raise InputError("tracks", f"have no {kind} markers", f"needs {kind} markers", "track them too")
    check_size(tracks["position"].values, "tracks")
    return tracks.isel(marker=chosen, axis=slice(0, 2))


def rest_positions(tracks: xr.Dataset, rest_frames: int) -> Floats:
    """Return the mean positions of markers in the frames at rest, (n_markers, 2)."""
    if tracks.sizes["time"] < rest_frames:
        fault = f"have {tracks.sizes['time']} frames"
        raise InputError("tracks", fault, f"needs the {rest_frames} at rest", "give a smaller rest_frames")
    return mean_at_rest(tracks["position"].values[:rest_frames], tracks["marker"].values)


def mean_at_rest(position: Floats, markers: NDArray[np.intp]) -> Floats:
    """Return the mean (n_markers, 2) of positions (n_frames, n_markers, 2) that are NaN where a marker is not seen."""
    count = (~np.isnan(position).any(axis=2)).sum(axis=0)
    if not count.all():
        fault, repair = "is seen in none of the frames at rest", "leave the marker out, or give a larger rest_frames"
        where = f"tracks: marker {markers[np.argmin(count)]}"
        raise InputError(where, fault, "needs a rest position of every marker", repair)
    mean: Floats = np.nansum(position, axis=0) / count[:, None]
    return mean


def motion_of(tracks: xr.Dataset, settings: MotionSettings | None = None) -> Motion:
    """Return how the internal markers moved since rest."""
    settings = settings or MotionSettings()
    chosen = markers_of(tracks, "internal")
    rest = rest_positions(chosen, settings.rest_frames)
    visible, time = seen(chosen), chosen["time"].values
    displacement = fill_unseen(chosen["position"].values - rest, visible, neighbour_weights(rest))
    usable = visible.mean(axis=1) >= settings.least_seen
    ring = chosen["ring"].values.astype(np.intp) if "ring" in chosen.variables else np.zeros(len(rest), dtype=np.intp)
    velocity = velocities(time, displacement, visible, settings.window)
    return Motion(time, rest, displacement, velocity, ring, visible, usable)


def neighbour_weights(rest: Floats) -> Floats:
    """Return how much each marker counts where another one is missing, (n, n): distance to the power -4.

    A marker counts most for its neighbours; with fewer markers seen, those farther away take over.
    """
    squared = ((rest[:, None] - rest) ** 2).sum(axis=2)
    spacing = squared[squared > 0].min() if (squared > 0).any() else 1.0
    weights: Floats = (np.maximum(squared, spacing) / spacing) ** -2.0
    np.fill_diagonal(weights, 0.0)
    return weights


def fill_unseen(displacement: Floats, visible: Flags, weights: Floats) -> Floats:
    """Return displacements (n_times, n_markers, 2), those of unseen markers from the seen ones of the same frame.

    They are 0 where none is seen; `visible` is (n_times, n_markers), `weights` (n_markers, n_markers).
    """
    if visible.all():
        return displacement
    total = (visible @ weights.T)[:, :, None]
    sums = np.einsum("tmd,nm->tnd", np.where(visible[:, :, None], displacement, 0.0), weights, optimize=True)
    guessed = np.divide(sums, total, out=np.zeros_like(sums), where=total > 0)
    return np.where(visible[:, :, None], displacement, guessed)


def velocities(time: Floats, displacement: Floats, visible: Flags, window: int) -> Floats:
    """Return the slope of straight lines through the last frames, by least squares, per second.

    A marker's line goes through the frames of the window in which it was seen. With fewer than two of them, as in the
    first frame, its velocity is the mean of the others', and 0 where there are none. Shapes are (n_times,) [s],
    (n_times, n_markers, 2) and (n_times, n_markers).
    """
    seen_before = visible.astype(np.float64)
    count, sum_t, sum_tt = (np.zeros_like(seen_before) for _ in range(3))
    sum_x, sum_tx = (np.zeros_like(displacement) for _ in range(2))
    for back in range(min(window, len(time))):
        now, then = slice(back, None), slice(0, len(time) - back)
        # Times from the newest frame and displacements from its own keep the sums free of rounding.
        ago = (time[then] - time[now])[:, None]
        change = displacement[then] - displacement[now]
        weight = seen_before[then]
        count[now] += weight
        sum_t[now] += weight * ago
        sum_tt[now] += weight * ago**2
        sum_x[now] += weight[:, :, None] * change
        sum_tx[now] += (weight * ago)[:, :, None] * change
    determined = (count > 1.5)[:, :, None]
    numerator = count[:, :, None] * sum_tx - sum_t[:, :, None] * sum_x
    spread = (count * sum_tt - sum_t**2)[:, :, None]
    slope = np.divide(numerator, spread, out=np.zeros_like(numerator), where=determined)
    number = determined.sum(axis=1)
    mean = np.divide(slope.sum(axis=1), number, out=np.zeros_like(slope[:, 0]), where=number > 0)
    return np.where(determined, slope, mean[:, None, :])


Columns = Mapping[str, Floats]

#: Features of the forest of Cordova Bulens et al. 2023: displacement and speed of every marker, 162 for 81 markers.
PUBLISHED = ("displacement", "speed")

#: Sectors of a ring; the layouts that ship repeat eight times in a turn.
_SECTORS = 8


@dataclass(frozen=True)
class FeatureSettings:
    """Which features are made, and of what motion."""

    sets: tuple[str, ...] = PUBLISHED  # names in :data:`FEATURE_SETS`
    motion: MotionSettings = field(default_factory=MotionSettings)

    def __post_init__(self) -> None:
        strange = [name for name in self.sets if name not in FEATURE_SETS]
        if strange or not self.sets or len(set(self.sets)) < len(self.sets):
            fault = f"got {shorten(', '.join(self.sets)) or 'none'}"
            raise InputError("features", fault, f"needs some of {', '.join(FEATURE_SETS)}, each once")


def features_of(motion: Motion, settings: FeatureSettings) -> Singles:
    """Return the features of every frame, shape (n_times, n_features), in the order of :func:`feature_names`."""
    blocks = [block for name in settings.sets for block in FEATURE_SETS[name](motion).values()]
    columns = [block.reshape(len(motion.time), -1) for block in blocks]
    values: Singles = np.concatenate(columns, axis=1).astype(np.float32)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        where = f"feature {feature_names(motion, settings)[column]} at {motion.time[row]:.6g} s"
        raise InputError(where, f"is {values[row, column]}", "needs a finite number", "check the tracks")
    return values


def feature_names(motion: Motion, settings: FeatureSettings) -> tuple[str, ...]:
    """Return the name of every feature: set, quantity, and the number of the marker in its kind."""
    first = motion.at(slice(0, 1))
    return tuple(
        f"{name}/{quantity}/{marker}" if block.ndim > 1 else f"{name}/{quantity}"
        for name in settings.sets
        for quantity, block in FEATURE_SETS[name](first).items()
        for marker in range(block.shape[1] if block.ndim > 1 else 1)
    )


def entropy(displacement: Floats) -> Floats:
    """Return the Shannon entropy of the lengths of displacements (n_times, n_markers, 2), shape (n_times,) [bit].

    It is 0 where all markers move alike, 4 where their shares of the largest are even in 16 bins.
    """
    length, bins = _lengths(displacement), 16
    largest = length.max(axis=1, keepdims=True)
    share = np.divide(length, largest, out=np.zeros_like(length), where=largest > 0)
    part = np.minimum((share * bins).astype(np.intp), bins - 1)
    counts = (part[:, :, None] == np.arange(bins)).sum(axis=1) / length.shape[1]
    logarithm = np.log2(counts, out=np.zeros_like(counts), where=counts > 0)
    bits: Floats = -(counts * logarithm).sum(axis=1)
    return bits + 0.0


def _lengths(vectors: Floats) -> Floats:
    lengths: Floats = np.linalg.norm(vectors, axis=2)
    return lengths


def _components(motion: Motion) -> Columns:
    moved, speed = motion.displacement, motion.velocity
    return {"x": moved[:, :, 0], "y": moved[:, :, 1], "speed_x": speed[:, :, 0], "speed_y": speed[:, :, 1]}


def _polar(motion: Motion) -> Columns:
    arm = motion.rest - motion.rest.mean(axis=0)
    squared = (arm**2).sum(axis=1)
    # A marker in the centre has no direction: both of its velocities are 0.
    central = squared < 1e-6 * squared.max() if squared.max() > 0 else np.ones(len(arm), dtype=bool)
    safe = np.where(central, 1.0, squared)
    radial = np.where(central, 0.0, (motion.velocity * arm).sum(axis=2) / np.sqrt(safe))
    cross = arm[:, 0] * motion.velocity[:, :, 1] - arm[:, 1] * motion.velocity[:, :, 0]
    return {"radial": radial, "angular": np.where(central, 0.0, cross / safe)}


def _sliding(motion: Motion) -> Columns:
    """Return means over sectors of each ring, counted from the direction in which the markers moved on the whole."""
    mean, arm = motion.displacement.mean(axis=1), motion.rest - motion.rest.mean(axis=0)
    direction = np.arctan2(mean[:, 1], mean[:, 0])
    # How much each marker belongs to each sector, (n_times, n_markers, n_sectors), is smooth in all angles.
    angle = np.arctan2(arm[:, 1], arm[:, 0])[:, None] - 2.0 * np.pi * np.arange(_SECTORS) / _SECTORS
    weights = (0.5 + 0.5 * np.cos(angle - direction[:, None, None])) ** _SECTORS + 1e-6
    turn = np.stack([np.cos(direction), np.sin(direction)], axis=1)
    columns: dict[str, Floats] = {}
    for name, vectors in (("displacement", motion.displacement), ("speed", motion.velocity)):
        along = np.einsum("tmd,td->tm", vectors, turn)
        across = turn[:, :1] * vectors[:, :, 1] - turn[:, 1:] * vectors[:, :, 0]
        for part, values in (("along", along), ("across", across)):
            for ring in np.unique(motion.ring).tolist():
                inside = motion.ring == ring
                share = weights[:, inside] / weights[:, inside].sum(axis=1, keepdims=True)
                columns[f"{name}_{part}_ring_{ring}"] = np.einsum("tmk,tm->tk", share, values[:, inside])
    return columns


def _rings(motion: Motion) -> Columns:
    lengths = {"displacement": _lengths(motion.displacement), "speed": _lengths(motion.velocity)}
    return {
        f"{name}_ring_{ring}": values[:, motion.ring == ring].mean(axis=1)
        for ring in np.unique(motion.ring).tolist()
        for name, values in lengths.items()
    }


def _rigid(motion: Motion) -> Columns:
    # A contact that sticks moves its markers like a rigid body, one that slips in part does not: Dong et al. 2019.
    residual = _lengths(fit_rigid_motions(motion.rest, motion.rest + motion.displacement).residual)
    return {"rms": np.sqrt((residual**2).mean(axis=1)), "residual": residual}


def _strain(motion: Motion) -> Columns:
    """Return divergence and largest shear of Green's strain [-], means over the triangles around each marker."""
    triangles = marker_triangles(motion.rest)
    alone = np.setdiff1d(np.arange(len(motion.rest)), triangles)
    if alone.size:
        raise InputError(f"marker {alone[0]}", "is in no triangle of markers", "needs others on two sides of it")
    gradients = triangle_gradients(motion.rest, motion.rest + motion.displacement, triangles)
    along_x, along_y, across = np.moveaxis(green_strain(gradients), -1, 0)
    divergence, shear = gradients[..., 0, 0] + gradients[..., 1, 1], np.hypot(0.5 * (along_x - along_y), across)
    means = (marker_means(values, motion.rest, triangles) for values in (divergence, shear))
    return dict(zip(("divergence", "shear"), means, strict=True))


def _field(motion: Motion) -> Columns:
    """Return what needs no layout: means and spreads over the markers, in units of the distance between them."""
    apart = float(np.median(np.sqrt(np.sort(((motion.rest[:, None] - motion.rest) ** 2).sum(axis=2))[:, 1])))
    triangles = marker_triangles(motion.rest)
    gradients = triangle_gradients(motion.rest, motion.rest + motion.displacement, triangles)
    moved, speed = _lengths(motion.displacement), _lengths(motion.velocity)
    residual = _rigid(motion)["rms"]
    columns = {
        "divergence": gradients[..., 0, 0] + gradients[..., 1, 1],
        "curl": gradients[..., 1, 0] - gradients[..., 0, 1],
        "displacement": moved / apart,
        "speed": speed / apart,
    }
    means = {f"{name}_mean": values.mean(axis=1) for name, values in columns.items()}
    spreads = {f"{name}_spread": values.std(axis=1) for name, values in columns.items()}
    rigid = {"rigid": residual / apart, "rigid_share": residual / (np.sqrt((moved**2).mean(axis=1)) + 0.01 * apart)}
    return {**means, **spreads, **rigid}


#: Sets of features that know neither number nor places of the markers: trials of different layouts have the same.
LAYOUT_FREE = frozenset({"field", "mean", "residual", "entropy", "time"})

#: Every set of features by its name: from a motion to columns of shape (n_times,) or (n_times, n_markers), by theirs.
#: ``time`` is no signal of the sensor: it is there to be beaten.
FEATURE_SETS: Mapping[str, Callable[[Motion], Columns]] = MappingProxyType(
    {
        "displacement": lambda motion: {"length": _lengths(motion.displacement)},
        "speed": lambda motion: {"length": _lengths(motion.velocity)},  # [1/s]
        "components": _components,
        "sliding": _sliding,
        "polar": _polar,
        "rings": _rings,
        "mean": lambda motion: {"displacement": _lengths(motion.displacement).mean(axis=1)},
        "rigid": _rigid,
        "residual": lambda motion: {"rms": _rigid(motion)["rms"]},
        "strain": _strain,
        "entropy": lambda motion: {"displacement": entropy(motion.displacement)},  # [bit]
        "field": _field,
        "time": lambda motion: {"seconds": motion.time},
    }
)


def ring_of_features(names: Sequence[str], ring: NDArray[np.intp]) -> list[int | None]:
    """Return the ring that each feature belongs to; None for those of all markers together."""

    def ring_of(quantity: str, marker: Sequence[str]) -> int | None:
        _, separator, inside = quantity.partition("_ring_")
        return int(inside) if separator else int(ring[int(marker[0])]) if marker else None

    return [ring_of(quantity, marker) for _, quantity, *marker in (name.split("/") for name in names)]
