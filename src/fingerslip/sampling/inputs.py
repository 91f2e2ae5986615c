"""What differs between the runs of a study, as numbers: ranges from 0 to 1, and a column for each choice."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError, shortened
from fingerslip.results import REPEAT, SAMPLE, RunResult
from fingerslip.units import si_quantity

__all__ = ["Input", "encoded", "inputs_of", "varied"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Input:
    """A value that differs between runs."""

    path: str  # its dotted path
    unit: str = ""  # its SI unit
    low: float = 0.0  # smallest and largest value [SI]
    high: float = 0.0  # smallest and largest value [SI]
    choices: tuple[Any, ...] = ()  # the values without order

    def columns(self, value: Any) -> tuple[float, ...]:
        """Return a value in columns from 0 to 1.

        Raises
        ------
        InputError
            For a value that no run is near: outside the range, another unit, or another choice.
        """
        if self.choices:
            if value not in self.choices:
                raise InputError(self.path, f"got {shortened(repr(value))}", f"needs one of {self._shown()}")
            return tuple(float(value == choice) for choice in self.choices)
        known = _number(value)
        if known is None or known[1] != self.unit or not self.low <= known[0] <= self.high:
            allowed = f"needs {self._shown()}, the range of the runs"
            raise InputError(self.path, f"got {shortened(repr(value))}", allowed, "predictions outside are guesses")
        return ((known[0] - self.low) / (self.high - self.low),)

    def at(self, share: float) -> Any:
        """Return the value at a share from 0 to 1."""
        if self.choices:
            return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]
        value = min(max(self.low + share * (self.high - self.low), self.low), self.high)
        return f"{value!r} {self.unit}" if self.unit else value

    def _shown(self) -> str:
        if self.choices:
            return ", ".join(map(str, self.choices))
        return f"{self.low:.6g} to {self.high:.6g} {self.unit}".strip()


def varied(run: RunResult) -> dict[str, Any]:
    """Return the swept and sampled values of a run by dotted path, without the numbers of samples and repeats."""
    own = {path: value for path, value in run.swept.items() if path not in (SAMPLE, REPEAT)}
    return {**own, **run.sampled}


def inputs_of(runs: Sequence[RunResult]) -> tuple[Input, ...]:
    """Return what differs between runs, in the order of their values."""
    paths = dict.fromkeys(path for run in runs for path in varied(run))
    found = tuple(_inputs(paths, [varied(run) for run in runs]))
    if not found:
        raise InputError("study", "has runs that do not differ", "needs values that are swept or sampled")
    return found


def encoded(inputs: Sequence[Input], values: Mapping[str, Any]) -> Array:
    """Return the columns of a run or of what is to be predicted."""
    missing = [one.path for one in inputs if one.path not in values]
    if missing:
        raise InputError(missing[0], "has no value", f"needs values of {', '.join(one.path for one in inputs)}")
    return np.array([column for one in inputs for column in one.columns(values[one.path])])


def _inputs(paths: Mapping[str, Any], values: Sequence[Mapping[str, Any]]) -> Iterator[Input]:
    for path in paths:
        found = [own.get(path) for own in values]
        numbers = [_number(one) for one in found]
        known = [one for one in numbers if one is not None]
        if len(known) == len(found) and len({unit for _, unit in known}) == 1:
            low, high = min(known)[0], max(known)[0]
            if low < high:
                yield Input(path, known[0][1], low, high)
        else:
            choices = tuple({repr(one): one for one in found}.values())
            if len(choices) > 1:
                yield Input(path, choices=choices)


def _number(value: object) -> tuple[float, str] | None:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value), ""
    return si_quantity(value) if isinstance(value, str) else None
