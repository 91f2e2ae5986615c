"""A surrogate: what a run would come to, between the runs that were computed, with an error that is checked.

A Gaussian process with a squared exponential kernel, whose length in each direction and whose noise maximise the
marginal likelihood (Rasmussen & Williams 2006). How good it is says cross-validation: every fifth of the runs is
predicted by a process that has not seen it, hyperparameters included.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.results import RunResult
from fingerslip.sampling.designs import Input, encode, inputs_of, required_output, varied_values

Array = NDArray[np.float64]

_FOLDS = 5
_LEAST_RUNS = 10
_LIKELY = 1.959963984540054  # standard deviations that hold 95 % of a normal distribution


@dataclass(frozen=True)
class Validation:
    """How well a surrogate predicts runs that it has not seen."""

    error: float  # root mean square of the errors, in the unit of the output
    largest: float  # largest error
    explained: float  # share of the variance that is predicted (Q2) [-]
    covered: float  # share of the runs inside the predicted 95 % interval [-]
    runs: int  # runs that the surrogate was fitted to: those with a value, each combination of inputs once
    repeated: int = 0  # runs with a value that were left out because another one has the same inputs
    missing: int = 0  # runs without a value


@dataclass(frozen=True)
class Prediction:
    """A predicted number with its 95 % interval, in the unit of the output."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, repr=False)
class Surrogate:
    """A fitted surrogate of one output."""

    output: str  # name of the output, as in :func:`~fingerslip.sampling.designs.output_of`
    unit: str  # its SI unit
    inputs: tuple[Input, ...]  # what may differ
    validation: Validation  # how good it is
    process: Any  # the fitted process

    def predict(self, values: Mapping[str, Any]) -> Prediction:
        """Predict the output.

        Parameters
        ----------
        values : mapping of str to object
            A value for each input by dotted path, as study files write them.

        Raises
        ------
        InputError
            For values that are missing or outside those of the runs.
        """
        mean, deviation = self.process.predict(encode(self.inputs, values)[None, :], return_std=True)
        middle, half = float(mean[0]), _LIKELY * float(deviation[0])
        return Prediction(middle, middle - half, middle + half)

    def means(self, columns: Array) -> Array:
        """Return the predicted means (n,) at encoded inputs (n, n_columns)."""
        result: Array = self.process.predict(columns)
        return result

    def __repr__(self) -> str:
        good = self.validation
        error = f"error {good.error:.3g} {self.unit}".strip()
        return f"<Surrogate of {self.output}: {good.runs} runs, Q2 {good.explained:.3f}, {error}>"


def fit_surrogate(runs: Sequence[RunResult], output: str, seed: int = 1) -> Surrogate:
    """Fit a surrogate to the runs of a study, and validate it.

    Parameters
    ----------
    runs : sequence of RunResult
        The runs; those without the output are left out, and of runs with the same inputs one is taken.
    output : str
        Name of the output.
    seed : int, optional
        Seed of the folds.

    Raises
    ------
    InputError
        For an unknown output, one that is the same in all runs, for too few runs, where scikit-learn is not installed.
    """
    inputs = inputs_of(runs)
    unit = required_output(runs[0], output).unit
    pairs = [(encode(inputs, varied_values(run)), required_output(run, output).value) for run in runs]
    valued = [(columns, value) for columns, value in pairs if value is not None]
    distinct: dict[bytes, tuple[Array, float]] = {}
    for columns, value in valued:
        distinct.setdefault(columns.tobytes(), (columns, value))
    if len(distinct) < _LEAST_RUNS:
        raise InputError("study", f"has {len(distinct)} runs with {output}", f"needs {_LEAST_RUNS} or more that differ")
    columns, values = (
        np.array([pair for pair, _ in distinct.values()]),
        np.array([pair for _, pair in distinct.values()]),
    )
    if np.ptp(values) == 0.0:
        raise InputError("of", f"'{output}' is {values[0]:.6g} {unit} in all runs", "needs an output that differs")
    process = _fit(columns, values, None)
    validation = replace(
        _validate(columns, values, process, seed),
        repeated=len(valued) - len(distinct),
        missing=len(pairs) - len(valued),
    )
    return Surrogate(output, unit, inputs, validation, process)


def _fit(columns: Array, values: Array, start: Any) -> Any:
    """Return a process fitted to values (n,) at columns (n, n_columns); `start` is a fitted one to begin from."""
    processes = _module("sklearn.gaussian_process")
    kernels = _module("sklearn.gaussian_process.kernels")
    first = kernels.ConstantKernel(1.0, (1e-3, 1e4)) * kernels.RBF(np.ones(columns.shape[1]), (5e-2, 1e3))
    kernel = first + kernels.WhiteKernel(1e-4, (1e-9, 1.0)) if start is None else start.kernel_
    process = processes.GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
    with warnings.catch_warnings():
        # A length at the end of its range means a value that does nothing, which is a result.
        warnings.simplefilter("ignore", _module("sklearn.exceptions").ConvergenceWarning)
        return process.fit(columns, values)


def _validate(columns: Array, values: Array, process: Any, seed: int) -> Validation:
    fold = np.random.default_rng(seed).permutation(values.size) % _FOLDS
    mean, deviation = np.empty_like(values), np.empty_like(values)
    for number in range(_FOLDS):
        left = fold == number
        fit = _fit(columns[~left], values[~left], process)
        mean[left], deviation[left] = fit.predict(columns[left], return_std=True)
    errors = mean - values
    return Validation(
        error=float(np.sqrt(np.mean(errors**2))),
        largest=float(np.abs(errors).max()),
        explained=float(1.0 - np.sum(errors**2) / np.sum((values - values.mean()) ** 2)),
        covered=float(np.mean(np.abs(errors) <= _LIKELY * deviation)),
        runs=int(values.size),
    )


def _module(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        fault, repair = "needs scikit-learn, which is not installed", "pip install 'fingerslip[sensitivity]'"
        raise InputError("surrogate", fault, "is an optional part", repair) from None
