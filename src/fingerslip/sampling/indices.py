"""What moves an output, over whole ranges: Sobol indices and Morris's elementary effects, with 95 % intervals.

The first-order index of a value is the share of the variance of the output that goes when the value is known, the
total index the share that is left when all others are known: the difference is interaction (Saltelli et al. 2010). An
elementary effect is the change of the output over a step of one value, over the step as a share of its range; the
mean of their sizes says how much the value matters, their standard deviation how much that depends on where the
others are (Morris 1991, Campolongo et al. 2007). Samples of another design are first fitted by a surrogate, on which
Sobol indices are computed.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.results import SAMPLE, RunResult, StudyResult
from fingerslip.sampling.designs import Input, block_size, draw_shares, encode, required_output
from fingerslip.sampling.sensitivity import groups_of
from fingerslip.sampling.surrogate import Validation, fit_surrogate

__all__ = ["Index", "Sensitivity", "morris_effects", "sobol_indices", "surrogate_indices"]

Array = NDArray[np.float64]

_RESAMPLES = 1000
_LEVEL = 0.95
_LEAST_BLOCKS = 4
_ON_SURROGATE = 1024
_SEED = 1


@dataclass(frozen=True)
class Index:
    """What one value does to an output."""

    path: str  # dotted path of the value
    size: float  # [-]
    size_error: float  # [-]
    other: float  # the first-order Sobol index [-]
    other_error: float = 0.0  # the first-order Sobol index [-]
    mean: float = 0.0  # the mean of the elementary effects with their signs


@dataclass(frozen=True)
class Sensitivity:
    """What moves one output in runs that differ in sampled values alone."""

    method: str  # what the numbers are
    output: str  # name of the output, its name in words, and its unit
    label: str  # name of the output, its name in words, and its unit
    unit: str  # name of the output, its name in words, and its unit
    group: Mapping[str, Any]  # the swept values that the runs have in common
    indices: tuple[Index, ...]  # one for each value, the one that matters most first
    mean: float  # mean and standard deviation of the output over the runs
    deviation: float  # mean and standard deviation of the output over the runs
    # runs that were used, blocks of the design that were, and blocks with a run without the output, which were not
    runs: int
    # runs that were used, blocks of the design that were, and blocks with a run without the output, which were not
    blocks: int = 0
    # runs that were used, blocks of the design that were, and blocks with a run without the output, which were not
    left_out: int = 0
    surrogate: Validation | None = None  # how good the surrogate is on which the indices were computed


def sobol_indices(study: StudyResult, output: str) -> tuple[Sensitivity, ...]:
    """Return the Sobol indices of an output, computed from the runs, for each combination of swept values."""
    _require_design(study, "saltelli")
    return tuple(_sobol_of_runs(study, group, runs, output) for group, runs in groups_of(study.runs))


def surrogate_indices(study: StudyResult, output: str) -> tuple[Sensitivity, ...]:
    """Return the Sobol indices of a surrogate of the output, for each combination of swept values.

    Their intervals are those of the indices of the surrogate; how far it is from the runs its validation says.
    """
    _require_samples(study)
    return tuple(_sobol_of_surrogate(group, runs, output) for group, runs in groups_of(study.runs))


def morris_effects(study: StudyResult, output: str) -> tuple[Sensitivity, ...]:
    """Return the elementary effects on an output for each combination of swept values."""
    _require_design(study, "morris")
    return tuple(_morris_of_runs(study, group, runs, output) for group, runs in groups_of(study.runs))


def _sobol_of_runs(study: StudyResult, group: Mapping[str, Any], runs: Sequence[RunResult], output: str) -> Sensitivity:
    blocks = _blocks(study, runs, output)
    if np.ptp(blocks.values) == 0.0:
        raise InputError("of", f"'{output}' is {blocks.values[0]:.6g} in all runs", "needs an output that differs")
    indices = _sobol(blocks.paths, blocks.values)
    return _sensitivity("sobol", output, (group, runs), blocks, _by_index(blocks.paths, indices))


def _sobol_of_surrogate(group: Mapping[str, Any], runs: Sequence[RunResult], output: str) -> Sensitivity:
    surrogate = fit_surrogate(runs, output)
    paths = tuple(variable.path for variable in surrogate.inputs)
    shares = draw_shares("saltelli", _ON_SURROGATE, len(paths), _SEED)
    columns = np.array([_encode(surrogate.inputs, row) for row in shares])
    indices = _sobol(paths, surrogate.means(columns))
    values = np.array([variable for run in runs if (variable := required_output(run, output).value) is not None])
    quantity = required_output(runs[0], output)
    return Sensitivity(
        method="sobol",
        output=output,
        label=quantity.label,
        unit=quantity.unit,
        group=dict(group),
        indices=_by_index(paths, indices),
        mean=float(values.mean()),
        deviation=float(values.std(ddof=1)),
        runs=values.size,
        surrogate=surrogate.validation,
    )


def _encode(inputs: Sequence[Input], shares: Array) -> Array:
    return encode(
        inputs, {variable.path: variable.at(float(share)) for variable, share in zip(inputs, shares, strict=True)}
    )


def _morris_of_runs(
    study: StudyResult, group: Mapping[str, Any], runs: Sequence[RunResult], output: str
) -> Sensitivity:
    blocks = _blocks(study, runs, output)
    effects = _salib("SALib.analyze.morris").analyze(
        _problem(blocks.paths), blocks.shares, blocks.values, num_resamples=_RESAMPLES, conf_level=_LEVEL, seed=_SEED
    )
    names = ("mu_star", "mu_star_conf", "sigma", "mu")
    rows = np.array([effects[name] for name in names], dtype=float).T.tolist()
    indices = [
        Index(path, size, error, deviation, mean=mean)
        for path, (size, error, deviation, mean) in zip(blocks.paths, rows, strict=True)
    ]
    return _sensitivity("morris", output, (group, runs), blocks, indices)


@dataclass(frozen=True)
class _Blocks:
    """The complete blocks of a design: shares (n, dim) and values (n,) of the output."""

    paths: tuple[str, ...]
    shares: Array
    values: Array
    blocks: int
    left_out: int


def _blocks(study: StudyResult, runs: Sequence[RunResult], output: str) -> _Blocks:
    design, paths = study.design, tuple(study.design["paths"])
    shares = draw_shares(design["method"], design["count"], len(paths), design["seed"])
    values = np.full(len(shares), np.nan)
    for run in runs:
        value = required_output(run, output).value
        values[int(run.swept[SAMPLE]) - 1] = np.nan if value is None else value
    size = block_size(design["method"], len(paths))
    whole = np.isfinite(values.reshape(-1, size)).all(axis=1)
    if whole.sum() < _LEAST_BLOCKS:
        raise InputError(
            "study",
            f"has {whole.sum()} whole blocks with {output}",
            f"needs {_LEAST_BLOCKS} or more",
            "finish its runs",
        )
    whole_rows = np.repeat(whole, size)
    return _Blocks(paths, shares[whole_rows], values[whole_rows], int(whole.sum()), int((~whole).sum()))


def _sensitivity(
    method: str,
    output: str,
    samples: tuple[Mapping[str, Any], Sequence[RunResult]],
    blocks: _Blocks,
    indices: Sequence[Index],
) -> Sensitivity:
    group, runs = samples
    quantity = required_output(runs[0], output)
    return Sensitivity(
        method=method,
        output=output,
        label=quantity.label,
        unit=quantity.unit,
        group=dict(group),
        indices=tuple(sorted(indices, key=lambda index: -index.size)),
        mean=float(blocks.values.mean()),
        deviation=float(blocks.values.std(ddof=1)),
        runs=blocks.values.size,
        blocks=blocks.blocks,
        left_out=blocks.left_out,
    )


def _sobol(paths: Sequence[str], values: Array) -> Mapping[str, Array]:
    indices: Mapping[str, Array] = _salib("SALib.analyze.sobol").analyze(
        _problem(paths),
        values,
        calc_second_order=False,
        num_resamples=_RESAMPLES,
        conf_level=_LEVEL,
        seed=_SEED,
    )
    return indices


def _by_index(paths: Sequence[str], result: Mapping[str, Array]) -> tuple[Index, ...]:
    rows = zip(paths, result["ST"], result["ST_conf"], result["S1"], result["S1_conf"], strict=True)
    indices = [Index(path, *map(float, numbers)) for path, *numbers in rows]
    return tuple(sorted(indices, key=lambda index: -index.size))


def _problem(paths: Sequence[str]) -> dict[str, Any]:
    return {"num_vars": len(paths), "names": list(paths), "bounds": [[0.0, 1.0]] * len(paths)}


def _require_design(study: StudyResult, needed: str) -> None:
    _require_samples(study)
    if study.design.get("method") != needed:
        fault = f"has samples of {study.design.get('method', 'another design')}"
        repair = f"use --method surrogate, or run the study with sample.method {needed}"
        raise InputError("method", fault, f"needs samples of {needed}", repair)


def _require_samples(study: StudyResult) -> None:
    if not study.ranges or not study.runs:
        repair = "write sample: {method: saltelli, ...} in the study"
        raise InputError("study", "has no samples", "needs a study with samples", repair)


def _salib(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        fault, repair = "needs SALib, which is not installed", "pip install 'fingerslip[sensitivity]'"
        raise InputError("sensitivity", fault, "is an optional part", repair) from None
