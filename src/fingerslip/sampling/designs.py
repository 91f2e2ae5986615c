"""Designs: where in the unit cube samples lie, as shares of the ranges of the sampled values.

``saltelli`` and ``morris`` come in blocks, each of which asks what every value does from one point on:

- A block of ``saltelli`` is a point a, then for every value j the point a with the j-th share of another point b, then
  b (Saltelli et al. 2010); a and b are halves of one point of a scrambled Sobol sequence.
- A block of ``morris`` is a walk through the levels 0, 1/3, 2/3, 1 that moves every share once by 2/3, in random order
  (Morris 1991).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import InputError, shorten
from fingerslip.results import REPEAT, SAMPLE, Quantity, RunResult
from fingerslip.slip import measures
from fingerslip.slip.windows import LATENCY, READINGS, TIMES, defines_time, event_label
from fingerslip.units import quantity_of

Method = Literal["latin_hypercube", "sobol", "random", "saltelli", "morris"]

#: Levels of Morris's walks.
LEVELS = 4


def draw_shares(method: Method, count: int, dim: int, seed: int) -> Floats:
    """Return the points of a design, (n, dim)."""
    # scipy.stats is slow to import.
    from scipy.stats import qmc

    if method == "morris":
        generator, step = np.random.default_rng(seed), LEVELS // 2
        walks = np.repeat(generator.integers(0, LEVELS, (count, 1, dim)), dim + 1, axis=1)
        for walk in walks:
            for number, j in enumerate(generator.permutation(dim), start=1):
                walk[number:, j] += step if walk[0, j] < step else -step
        return np.asarray(walks.reshape(-1, dim) / (LEVELS - 1.0))
    if method == "random":
        return np.random.default_rng(seed).random((count, dim))
    if method == "saltelli":
        first, second = np.split(qmc.Sobol(2 * dim, seed=seed).random(count), 2, axis=1)
        blocks = np.repeat(first[:, None, :], dim + 2, axis=1)
        for j in range(dim):
            blocks[:, j + 1, j] = second[:, j]
        blocks[:, -1] = second
        return blocks.reshape(-1, dim)
    sequence = qmc.Sobol if method == "sobol" else qmc.LatinHypercube
    return np.asarray(sequence(dim, seed=seed).random(count))


def block_size(method: Method, dim: int) -> int:
    """Return how many points belong together: 1 where every point stands for itself."""
    return {"saltelli": dim + 2, "morris": dim + 1}.get(method, 1)


@dataclass(frozen=True)
class Input:
    """A value that differs between runs."""

    path: str  # its dotted path
    unit: str = ""  # its SI unit
    low: float = 0.0  # smallest and largest value [SI]
    high: float = 0.0
    choices: tuple[Any, ...] = ()  # the values without order

    def columns(self, value: Any) -> tuple[float, ...]:
        """Return a value in columns from 0 to 1; refuse one that no run is near."""
        if self.choices:
            if value not in self.choices:
                raise InputError(self.path, f"got {shorten(repr(value))}", f"needs one of {self._show()}")
            return tuple(float(value == choice) for choice in self.choices)
        number = quantity_of(value)
        if number is None or number[1] != self.unit or not self.low <= number[0] <= self.high:
            allowed = f"needs {self._show()}, the range of the runs"
            raise InputError(self.path, f"got {shorten(repr(value))}", allowed, "predictions outside are guesses")
        return ((number[0] - self.low) / (self.high - self.low),)

    def at(self, share: float) -> Any:
        """Return the value at a share from 0 to 1."""
        if self.choices:
            return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]
        value = min(max(self.low + share * (self.high - self.low), self.low), self.high)
        return f"{value!r} {self.unit}" if self.unit else value

    def _show(self) -> str:
        if self.choices:
            return ", ".join(map(str, self.choices))
        return f"{self.low:.6g} to {self.high:.6g} {self.unit}".strip()


def varied_values(run: RunResult) -> dict[str, Any]:
    """Return the swept and sampled values of a run by dotted path, without the numbers of samples and repeats."""
    values = {path: value for path, value in run.swept.items() if path not in (SAMPLE, REPEAT)}
    return {**values, **run.sampled}


def inputs_of(runs: Sequence[RunResult]) -> tuple[Input, ...]:
    """Return what differs between runs, in the order of their values."""
    values, inputs = [varied_values(run) for run in runs], []
    for path in dict.fromkeys(path for run_values in values for path in run_values):
        column = [run_values.get(path) for run_values in values]
        numbers = [number for value in column if (number := quantity_of(value)) is not None]
        choices = tuple({repr(value): value for value in column}.values())
        if len(numbers) == len(column) and len({unit for _, unit in numbers}) == 1:
            low, high = min(numbers)[0], max(numbers)[0]
            inputs += [Input(path, numbers[0][1], low, high)] if low < high else []
        elif len(choices) > 1:
            inputs.append(Input(path, choices=choices))
    if not inputs:
        raise InputError("study", "has runs that do not differ", "needs values that are swept or sampled")
    return tuple(inputs)


def encode(inputs: Sequence[Input], values: Mapping[str, Any]) -> Floats:
    """Return the columns of a run or of what is to be predicted."""
    missing = [variable.path for variable in inputs if variable.path not in values]
    if missing:
        allowed = f"needs values of {', '.join(variable.path for variable in inputs)}"
        raise InputError(missing[0], "has no value", allowed)
    return np.array([column for variable in inputs for column in variable.columns(values[variable.path])])


def output_of(run: RunResult, name: str) -> Quantity | None:
    """Return a number of a run by its name; None where nothing has it."""
    if name in run.derived:
        return run.derived[name]
    if name in _EVENTS:
        reading, time = _EVENTS[name]
        return Quantity(f"{event_label(time)} ({READINGS[reading]})", "s", run.events.reading(reading).time(time))
    measure = next((entry for entry in measures.MEASURES if entry.name == name), None)
    if measure is None:
        return None
    value = run.numbers.get(measure.key)
    return Quantity(measure.label, measure.unit.si if measure.unit else "", None if value is None else float(value))


def required_output(run: RunResult, name: str) -> Quantity:
    """Return a number of a run by its name as :func:`output_of`."""
    quantity = output_of(run, name)
    if quantity is None:
        raise InputError("of", f"'{name}' is not known", f"needs one of {', '.join(output_names(run))}")
    return quantity


def output_names(run: RunResult) -> tuple[str, ...]:
    """Return all names that :func:`output_of` knows of a run."""
    return (*_EVENTS, *(measure.name for measure in measures.MEASURES), *run.derived)


#: Reading and time of each name of a slip time, such as ``overall_slip`` or ``latency_acceleration``.
_EVENTS: Mapping[str, tuple[str, str]] = {
    (time if time == LATENCY else f"{time}_slip") + ("" if reading == "slip" else f"_{reading}"): (reading, time)
    for reading in READINGS
    for time in TIMES
    if defines_time(reading, time)
}
