"""What classifiers see of a frame: sets of features, each a function of the motion of the markers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.motion import Motion, MotionSettings
from fingerslip.errors import InputError, shorten
from fingerslip.vision.fields import (
    fit_rigid_motions,
    green_strain,
    marker_means,
    marker_triangles,
    triangle_gradients,
)

Floats = NDArray[np.float64]
Columns = Mapping[str, Floats]


def rigid_residual(rest: Floats, displacement: Floats) -> Floats:
    """Return what is left of a displacement when the best rigid motion is taken away, shape (n_times, n_markers, 2).

    A contact that sticks moves its markers like a rigid body, one that slips in part does not: Dong et al. 2019.

    Arrays: rest (n_markers, 2); displacement (n_times, n_markers, 2).
    """
    return fit_rigid_motions(rest, rest + displacement).residual


def strains(rest: Floats, displacement: Floats) -> tuple[Floats, Floats]:
    """Return divergence and largest shear strain around each marker, each of shape (n_times, n_markers) [-].

    They are means over the triangles around it: of the trace of the displacement's gradient, and of half the difference
    of the principal values of Green's strain.

    Parameters
    ----------
    rest : (n_markers, 2) array
        Positions at rest.
    displacement : (n_times, n_markers, 2) array
        Displacements without gaps.

    Raises
    ------
    InputError
        Where a marker is in no triangle, as when all lie on a line.
    """
    triangles = marker_triangles(rest)
    alone = np.setdiff1d(np.arange(len(rest)), triangles)
    if alone.size:
        raise InputError(f"marker {alone[0]}", "is in no triangle of markers", "needs others on two sides of it")
    gradients = triangle_gradients(rest, rest + displacement, triangles)
    along_x, along_y, across = np.moveaxis(green_strain(gradients), -1, 0)
    divergence = gradients[..., 0, 0] + gradients[..., 1, 1]
    shear = np.hypot(0.5 * (along_x - along_y), across)
    return marker_means(divergence, rest, triangles), marker_means(shear, rest, triangles)


def entropy(displacement: Floats, bins: int = 16) -> Floats:
    """Return the Shannon entropy of the lengths of displacements at each time, shape (n_times,) [bit].

    It is 0 where all markers move alike, log2(bins) where their shares of the largest are even.

    Arrays: displacement (n_times, n_markers, 2).
    """
    length = _lengths(displacement)
    largest = length.max(axis=1, keepdims=True)
    share = np.divide(length, largest, out=np.zeros_like(length), where=largest > 0)
    part = np.minimum((share * bins).astype(np.intp), bins - 1)
    counts = (part[:, :, None] == np.arange(bins)).sum(axis=1) / length.shape[1]
    logarithm = np.log2(counts, out=np.zeros_like(counts), where=counts > 0)
    bits: Floats = -(counts * logarithm).sum(axis=1)
    return bits + 0.0


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


@dataclass(frozen=True)
class FeatureSet:
    """One set of features."""

    meaning: str  # what they are, with their unit
    # from a motion to columns of shape (n_times,) or (n_times, n_markers), by name
    columns: Callable[[Motion], Columns]


def features_of(motion: Motion, settings: FeatureSettings) -> NDArray[np.float32]:
    """Return the features of every frame, shape (n_times, n_features), in the order of :func:`feature_names`."""
    blocks = [
        np.reshape(block, (len(motion.time), -1))
        for name in settings.sets
        for block in FEATURE_SETS[name].columns(motion).values()
    ]
    values: NDArray[np.float32] = np.concatenate(blocks, axis=1).astype(np.float32)
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
        for quantity, block in FEATURE_SETS[name].columns(first).items()
        for marker in range(block.shape[1] if block.ndim > 1 else 1)
    )


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
    mean = motion.displacement.mean(axis=1)
    direction = np.arctan2(mean[:, 1], mean[:, 0])
    weights = _sector_weights(motion, direction)
    turn = np.stack([np.cos(direction), np.sin(direction)], axis=1)
    columns: dict[str, Floats] = {}
    for name, vectors in (("displacement", motion.displacement), ("speed", motion.velocity)):
        along = np.einsum("tmd,td->tm", vectors, turn)
        across = turn[:, :1] * vectors[:, :, 1] - turn[:, 1:] * vectors[:, :, 0]
        for part, values in (("along", along), ("across", across)):
            for ring, inside in _members(motion):
                share = weights[:, inside] / weights[:, inside].sum(axis=1, keepdims=True)
                columns[f"{name}_{part}_ring_{ring}"] = np.einsum("tmk,tm->tk", share, values[:, inside])
    return columns


def _sector_weights(motion: Motion, direction: Floats) -> Floats:
    """Return how much each marker belongs to each sector, (n_times, n_markers, n_sectors), smooth in all angles."""
    arm = motion.rest - motion.rest.mean(axis=0)
    angle = np.arctan2(arm[:, 1], arm[:, 0])[:, None] - 2.0 * np.pi * np.arange(_SECTORS) / _SECTORS
    weights: Floats = (0.5 + 0.5 * np.cos(angle - direction[:, None, None])) ** _SECTORS + 1e-6
    return weights


def _members(motion: Motion) -> list[tuple[int, NDArray[np.bool_]]]:
    return [(int(ring), motion.ring == ring) for ring in np.unique(motion.ring)]


def _rings(motion: Motion) -> Columns:
    lengths = {"displacement": _lengths(motion.displacement), "speed": _lengths(motion.velocity)}
    return {
        f"{name}_ring_{ring}": values[:, inside].mean(axis=1)
        for ring, inside in _members(motion)
        for name, values in lengths.items()
    }


def _rigid(motion: Motion) -> Columns:
    residual = _lengths(rigid_residual(motion.rest, motion.displacement))
    return {"rms": np.sqrt((residual**2).mean(axis=1)), "residual": residual}


#: Every set of features by its name. ``time`` is no signal of the sensor: it is there to be beaten.
FEATURE_SETS: Mapping[str, FeatureSet] = MappingProxyType(
    {
        "displacement": FeatureSet(
            "length of each marker's displacement since rest", lambda motion: {"length": _lengths(motion.displacement)}
        ),
        "speed": FeatureSet("speed of each marker [1/s]", lambda motion: {"length": _lengths(motion.velocity)}),
        "components": FeatureSet("displacement and velocity of each marker along x and y", _components),
        "sliding": FeatureSet(
            "displacement and velocity of sectors of each ring, in the frame of the motion", _sliding
        ),
        "polar": FeatureSet("velocity of each marker away from the centre, and about it [rad/s]", _polar),
        "rings": FeatureSet("mean displacement and speed of each ring", _rings),
        "mean": FeatureSet(
            "mean length of the displacements",
            lambda motion: {"displacement": _lengths(motion.displacement).mean(axis=1)},
        ),
        "rigid": FeatureSet("what is left of the displacements without the best rigid motion", _rigid),
        "residual": FeatureSet("root mean square of that alone", lambda motion: {"rms": _rigid(motion)["rms"]}),
        "strain": FeatureSet(
            "divergence and largest shear strain at each marker [-]",
            lambda motion: dict(zip(("divergence", "shear"), strains(motion.rest, motion.displacement), strict=True)),
        ),
        "entropy": FeatureSet(
            "entropy of the lengths of the displacements [bit]",
            lambda motion: {"displacement": entropy(motion.displacement)},
        ),
        "time": FeatureSet("time since the start of the tracks [s]", lambda motion: {"seconds": motion.time}),
    }
)


def ring_of_features(names: Sequence[str], ring: NDArray[np.intp]) -> list[int | None]:
    """Return the ring that each feature belongs to; None for those of all markers together."""

    def ring_of(quantity: str, marker: Sequence[str]) -> int | None:
        _, separator, inside = quantity.partition("_ring_")
        return int(inside) if separator else int(ring[int(marker[0])]) if marker else None

    return [ring_of(quantity, marker) for _, quantity, *marker in (name.split("/") for name in names)]
