"""Repeats: every run several times, with values that scatter as they do from trial to trial."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
import pydantic

from fingerslip.errors import InputError, shorten
from fingerslip.parameters import parameters
from fingerslip.units import si_quantity

__all__ = ["RepeatSettings", "scatter_values", "seed_of_repeat"]

_DIGITS = 6


def _check_scatter(scatter: Mapping[str, Any]) -> Mapping[str, Any]:
    if not scatter:
        raise InputError("", "is empty", "needs a standard deviation by dotted path", "all repeats are alike")
    for path, deviation in scatter.items():
        quantity = _quantity(deviation)
        if quantity is None or not 0.0 < quantity[0] < math.inf:
            fault, allowed = f"got {shorten(repr(deviation))}", "needs a standard deviation above 0"
            raise InputError(path, fault, allowed, "write a number, or a quantity such as '0.1 mm'")
    return scatter


Scatter = Annotated[Mapping[str, Any], pydantic.AfterValidator(_check_scatter)]


@parameters
class RepeatSettings:
    """Repeats of every run.

    Parameters
    ----------
    count : int
        How many.
    scatter : mapping of str to object
        Standard deviations by dotted path, numbers or quantities. In each repeat the value is drawn from a normal
        distribution around that of the run; the draws of a repeat are the same in all runs.
    seed : int
        Seed of all random numbers. Each repeat has a seed of its own, which follows from this one and its number.
    """

    count: Annotated[int, pydantic.Field(ge=1, le=100_000)]
    scatter: Scatter
    seed: Annotated[int, pydantic.Field(ge=0)] = 1


def seed_of_repeat(settings: RepeatSettings, number: int) -> int:
    """Return the seed of a repeat, which numbers from 1."""
    return int(np.random.SeedSequence([settings.seed, number]).generate_state(1)[0])


def scatter_values(settings: RepeatSettings, number: int, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a repeat by dotted path, as a study file writes them.

    Examples
    --------
    >>> scatter_values(RepeatSettings(count=2, scatter={"time.end": "0.1 s"}), 1, {"time.end": "3 s"})
    {'time.end': '3.08945 s'}
    """
    draws = np.random.default_rng(seed_of_repeat(settings, number)).standard_normal(len(settings.scatter))
    pairs = zip(settings.scatter.items(), draws, strict=True)
    return {path: _drawn(path, values.get(path), deviation, float(draw)) for (path, deviation), draw in pairs}


def _drawn(path: str, value: Any, deviation: Any, draw: float) -> Any:
    quantity, spread = _quantity(value), _quantity(deviation)
    where = f"repeats.scatter.{path}"
    if quantity is None:
        fault = "is not known" if value is None else f"leads to {shorten(repr(value))}"
        raise InputError(where, fault, "needs the dotted path of a number", "fingerslip show STUDY lists all paths")
    if spread is None or spread[1] != quantity[1]:
        raise InputError(
            where, f"got {shorten(repr(deviation))}", f"needs a unit of [{quantity[1] or 'a pure number'}]"
        )
    text = f"{quantity[0] + draw * spread[0]:.{_DIGITS}g}"
    return f"{text} {quantity[1]}" if quantity[1] else float(text)


def _quantity(value: object) -> tuple[float, str] | None:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value), ""
    return si_quantity(value) if isinstance(value, str) else None
