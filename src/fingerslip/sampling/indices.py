"""What moves an output, over whole ranges: Sobol indices and Morris's elementary effects, with 95 % intervals.

The first-order index of a value is the share of the variance of the output that goes when the value is known, the
total index the share that is left when all others are known: the difference is interaction (Saltelli et al. 2010). An
elementary effect is the change of the output over a step of one value, over the step as a share of its range; the
mean of their sizes says how much the value matters, their standard deviation how much that depends on where the
others are (Morris 1991, Campolongo et al. 2007). Samples of another design are first fitted by a surrogate, on which
Sobol indices are computed.

The surrogate is a Gaussian process with a squared exponential kernel, whose length in each direction and whose noise
maximise the marginal likelihood (Rasmussen & Williams 2006). How good it is says cross-validation: every fifth of the
runs is predicted by a process that has not seen it, hyperparameters included.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import InputError, optional_module
from fingerslip.results import SAMPLE, RunResult, StudyResult
from fingerslip.sampling.designs import (
    Input,
    Method,
    block_size,
    draw_shares,
    encode,
    inputs_of,
    required_output,
    varied_values,
)
from fingerslip.sampling.sensitivity import groups_of

# What needs them, in errors.
_SALIB, _SKLEARN = ("sensitivity", "sensitivity", "indices need it"), ("surrogate", "sensitivity", "surrogates need it")
_LEAST_BLOCKS = 4
_ON_SURROGATE = 1024
_SEED = 1
_OPTIONS = {"num_resamples": 1000, "conf_level": 0.95, "seed": _SEED}
# The design that each method needs.
_DESIGNS: Mapping[str, Method] = {"sobol": "saltelli", "morris": "morris"}
# SALib's names of the fields of an index.
_COLUMNS = {
    "sobol": {"size": "ST", "size_error": "ST_conf", "other": "S1", "other_error": "S1_conf"},
    "morris": {"size": "mu_star", "size_error": "mu_star_conf", "other": "sigma", "mean": "mu"},
}


@dataclass(frozen=True)
class Index:
    """What one value does to an output."""

    path: str  # dotted path of the value
    size: float  # total Sobol index, or mean size of the elementary effects
    size_error: float  # half of its 95 % interval
    other: float  # first-order Sobol index, or standard deviation of the elementary effects
    other_error: float = 0.0
    mean: float = 0.0  # the mean of the elementary effects with their signs


@dataclass(frozen=True)
class Sensitivity:
    """What moves one output in runs that differ in sampled values alone."""

    method: str
    output: str  # name of the output
    label: str  # its name in words
    unit: str
    group: Mapping[str, Any]  # the swept values that the runs have in common
    indices: tuple[Index, ...]  # one for each value, the one that matters most first
    mean: float  # of the output over the runs
    deviation: float
    runs: int  # that were used
    blocks: int = 0  # blocks of the design that were used
    left_out: int = 0  # blocks with a run without the output
    surrogate: Validation | None = None  # how good the surrogate is on which the indices were computed


def block_indices(study: StudyResult, output: str, method: str) -> tuple[Sensitivity, ...]:
    """Compute `sobol` indices or `morris` effects from the whole blocks of a design, for each group of swept values."""
    _require_samples(study)
    design, needed = study.design, _DESIGNS[method]
    if design.get("method") != needed:
        fault = f"has samples of {design.get('method', 'another design')}"
        repair = f"use --method surrogate, or run the study with sample.method {needed}"
        raise InputError("method", fault, f"needs samples of {needed}", repair)
    paths, sensitivities = tuple(design["paths"]), []
    shares, size = draw_shares(needed, design["count"], len(paths), design["seed"]), block_size(needed, len(paths))
    for group, runs in groups_of(study.runs):
        values = np.full(len(shares), np.nan)
        for run in runs:
            value = required_output(run, output).value
            values[int(run.swept[SAMPLE]) - 1] = np.nan if value is None else value
        whole = np.isfinite(values.reshape(-1, size)).all(axis=1)
        blocks, used = int(whole.sum()), np.repeat(whole, size)
        if blocks < _LEAST_BLOCKS:
            fault, allowed = f"has {blocks} whole blocks with {output}", f"needs {_LEAST_BLOCKS} or more"
            raise InputError("study", fault, allowed, "finish its runs")
        values = values[used]
        if method == "sobol" and np.ptp(values) == 0.0:
            raise InputError("of", f"'{output}' is {values[0]:.6g} in all runs", "needs an output that differs")
        indices, about = _indices(method, paths, shares[used], values), _statistics(runs[0], output, values)
        left_out = len(whole) - blocks
        sensitivities.append(
            Sensitivity(method, group=dict(group), indices=indices, blocks=blocks, left_out=left_out, **about)
        )
    return tuple(sensitivities)


def surrogate_indices(study: StudyResult, output: str) -> tuple[Sensitivity, ...]:
    """Return the Sobol indices of a surrogate of the output, for each combination of swept values.

    Their intervals are those of the indices of the surrogate; how far it is from the runs its validation says.
    """
    _require_samples(study)
    sensitivities = []
    for group, runs in groups_of(study.runs):
        surrogate = fit_surrogate(runs, output)
        inputs, paths = surrogate.inputs, tuple(variable.path for variable in surrogate.inputs)
        shares = draw_shares("saltelli", _ON_SURROGATE, len(paths), _SEED)
        samples = (
            {entry.path: entry.at(share) for entry, share in zip(inputs, row, strict=True)} for row in shares.tolist()
        )
        means = surrogate.process.predict(np.array([encode(inputs, sample) for sample in samples]))
        values = np.array([number for run in runs if (number := required_output(run, output).value) is not None])
        indices, about = _indices("sobol", paths, shares, means), _statistics(runs[0], output, values)
        sensitivities.append(
            Sensitivity("sobol", group=dict(group), indices=indices, surrogate=surrogate.validation, **about)
        )
    return tuple(sensitivities)


def _require_samples(study: StudyResult) -> None:
    if not study.ranges or not study.runs:
        repair = "write sample: {method: saltelli, ...} in the study"
        raise InputError("study", "has no samples", "needs a study with samples", repair)


def _indices(method: str, paths: Sequence[str], shares: Floats, values: Floats) -> tuple[Index, ...]:
    """Return what SALib makes of the values (n,) of an output at shares (n, n_paths), the largest first."""
    analyze = optional_module(f"SALib.analyze.{method}", *_SALIB).analyze
    problem = {"num_vars": len(paths), "names": list(paths), "bounds": [[0.0, 1.0]] * len(paths)}
    if method == "sobol":
        columns = analyze(problem, values, calc_second_order=False, **_OPTIONS)
    else:
        columns = analyze(problem, shares, values, **_OPTIONS)
    indices = (
        Index(path, **{field: float(columns[name][row]) for field, name in _COLUMNS[method].items()})
        for row, path in enumerate(paths)
    )
    return tuple(sorted(indices, key=lambda index: -index.size))


def _statistics(run: RunResult, output: str, values: Floats) -> dict[str, Any]:
    """Return what an output is called, and mean and deviation of its values (n,), as a sensitivity has them."""
    quantity = required_output(run, output)
    numbers = {"mean": float(values.mean()), "deviation": float(values.std(ddof=1)), "runs": values.size}
    return {"output": output, "label": quantity.label, "unit": quantity.unit, **numbers}


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


@dataclass(frozen=True)
class Surrogate:
    """A fitted surrogate of one output."""

    output: str  # name of the output, as in :func:`~fingerslip.sampling.designs.output_of`
    unit: str  # its SI unit
    inputs: tuple[Input, ...]  # what may differ
    validation: Validation  # how good it is
    process: Any  # the fitted process

    def predict(self, values: Mapping[str, Any]) -> Prediction:
        """Predict the output for a value of each input by dotted path, as study files write them."""
        mean, deviation = self.process.predict(encode(self.inputs, values)[None, :], return_std=True)
        middle, half = float(mean[0]), _LIKELY * float(deviation[0])
        return Prediction(middle, middle - half, middle + half)


def fit_surrogate(runs: Sequence[RunResult], output: str) -> Surrogate:
    """Fit a surrogate to the runs of a study, and validate it.

    Runs without the output are left out, and of runs with the same inputs one is taken.
    """
    inputs = inputs_of(runs)
    unit = required_output(runs[0], output).unit
    pairs = [(encode(inputs, varied_values(run)), required_output(run, output).value) for run in runs]
    valued = [(columns, value) for columns, value in pairs if value is not None]
    distinct: dict[bytes, tuple[Floats, float]] = {}
    for columns, value in valued:
        distinct.setdefault(columns.tobytes(), (columns, value))
    if len(distinct) < _LEAST_RUNS:
        raise InputError("study", f"has {len(distinct)} runs with {output}", f"needs {_LEAST_RUNS} or more that differ")
    columns, values = (np.array(column) for column in zip(*distinct.values(), strict=True))
    if np.ptp(values) == 0.0:
        raise InputError("of", f"'{output}' is {values[0]:.6g} {unit} in all runs", "needs an output that differs")
    process = fit_process(columns, values, None)
    repeated, missing = len(valued) - len(distinct), len(pairs) - len(valued)
    validation = replace(_validate(columns, values, process), repeated=repeated, missing=missing)
    return Surrogate(output, unit, inputs, validation, process)


def fit_process(columns: Floats, values: Floats, start: Any) -> Any:
    """Return a process fitted to values (n,) at columns (n, n_columns); `start` is a fitted one to begin from."""
    processes = optional_module("sklearn.gaussian_process", *_SKLEARN)
    kernels = optional_module("sklearn.gaussian_process.kernels", *_SKLEARN)
    first = kernels.ConstantKernel(1.0, (1e-3, 1e4)) * kernels.RBF(np.ones(columns.shape[1]), (5e-2, 1e3))
    kernel = first + kernels.WhiteKernel(1e-4, (1e-9, 1.0)) if start is None else start.kernel_
    process = processes.GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
    with warnings.catch_warnings():
        # A length at the end of its range means a value that does nothing, which is a result.
        warnings.simplefilter("ignore", optional_module("sklearn.exceptions", *_SKLEARN).ConvergenceWarning)
        return process.fit(columns, values)


def _validate(columns: Floats, values: Floats, process: Any) -> Validation:
    fold = np.random.default_rng(_SEED).permutation(values.size) % _FOLDS
    mean, deviation = np.empty_like(values), np.empty_like(values)
    for number in range(_FOLDS):
        left = fold == number
        fit = fit_process(columns[~left], values[~left], process)
        mean[left], deviation[left] = fit.predict(columns[left], return_std=True)
    errors = mean - values
    return Validation(
        error=float(np.sqrt(np.mean(errors**2))),
        largest=float(np.abs(errors).max()),
        explained=float(1.0 - np.sum(errors**2) / np.sum((values - values.mean()) ** 2)),
        covered=float(np.mean(np.abs(errors) <= _LIKELY * deviation)),
        runs=int(values.size),
    )
