"""Which trials a classifier learns from and which it is tested on: by trial, by sample, by condition."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError

__all__ = ["benchmark_test_trials", "grouped_folds", "held_out", "left_out", "sample_split"]

#: Numbers of more values than this are left out in ranges instead of one by one.
_VALUES, _RANGES = 8, 4


def held_out(names: Sequence[str], count: int, seed: int) -> tuple[str, ...]:
    """Return some trials, chosen by hashes of their names: the same on every machine and in every order."""
    if not 0 <= count <= len(names):
        raise InputError("trials", f"got {len(names)}", f"needs at least {count}")
    return tuple(sorted(names, key=lambda name: hashlib.sha256(f"{seed}:{name}".encode()).hexdigest())[:count])


def grouped_folds(names: Sequence[str], folds: int, seed: int) -> list[tuple[str, ...]]:
    """Return the test trials of each fold; every trial is in one of them."""
    if not 2 <= folds <= len(names):
        raise InputError("folds", f"got {folds}", f"needs 2 to {len(names)}, the number of trials")
    order = held_out(names, len(names), seed)
    return [order[number::folds] for number in range(folds)]


def benchmark_test_trials(names: Sequence[str], seed: int = 0, share: float = 0.2) -> tuple[str, ...]:
    """Return the trials that a submission is scored on, sorted; the others are there to learn from.

    Raises
    ------
    InputError
        Where the share is not between 0 and 1.
    """
    if not 0.0 < share < 1.0:
        raise InputError("share", f"got {share}", "needs a number between 0 and 1")
    return tuple(sorted(held_out(names, max(1, round(share * len(names))), seed)))


def sample_split(count: int, seed: int, share: float = 0.1) -> NDArray[np.bool_]:
    """Return which samples are tested when samples are split whatever trial they are of, as published: 90 to 10.

    Frames of one trial are then on both sides. The accuracy says how well a classifier knows trials that it has seen.
    """
    tested = np.zeros(count, dtype=bool)
    tested[np.random.default_rng(seed).permutation(count)[: round(share * count)]] = True
    return tested


def left_out(conditions: Mapping[str, Mapping[str, Any]], key: str) -> dict[str, tuple[str, ...]]:
    """Return the trials of each value of a condition; of each quarter of its range where it has many values."""
    for name, values in conditions.items():
        if key not in values:
            raise InputError(f"trial {name}", f"has no condition {key!r}", "needs it to be left out by it")
    values = {name: found[key] for name, found in conditions.items()}
    different = sorted(set(values.values()), key=lambda value: (isinstance(value, str), value))
    if len(different) < 2:
        raise InputError(f"condition {key!r}", f"is {different[0]!r} in all trials", "needs at least two values")
    if len(different) > _VALUES and not any(isinstance(value, str) for value in different):
        return _by_range(values)
    return {_text(one): tuple(name for name, value in values.items() if value == one) for one in different}


def _by_range(values: Mapping[str, float]) -> dict[str, tuple[str, ...]]:
    edges = np.quantile(list(values.values()), np.linspace(0.0, 1.0, _RANGES + 1))
    places = np.clip(np.searchsorted(edges, list(values.values()), side="right") - 1, 0, _RANGES - 1)
    found = {}
    for number in range(_RANGES):
        label = f"{edges[number]:.4g} to {edges[number + 1]:.4g}"
        found[label] = tuple(name for name, place in zip(values, places, strict=True) if place == number)
    return {label: names for label, names in found.items() if names}


def _text(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
