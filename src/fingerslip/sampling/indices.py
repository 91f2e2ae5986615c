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
from fingerslip.sampling.designs import block_size, draw_shares, encode, required_output
from fingerslip.sampling.sensitivity import groups_of
from fingerslip.sampling.surrogate import Validation, fit_surrogate

Array = NDArray[np.float64]

_LEAST_BLOCKS = 4
_ON_SURROGATE = 1024
_SEED = 1
_OPTIONS = {"num_resamples": 1000, "conf_level": 0.95, "seed": _SEED}


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


def sobol_indices(study: StudyResult, output: str) -> tuple[Sensitivity, ...]:
    """Return the Sobol indices of an output, computed from the runs, for each combination of swept values."""
    _require_design(study, "saltelli")
    return tuple(_of_runs(study, group, runs, output, "sobol") for group, runs in groups_of(study.runs))


def morris_effects(study: StudyResult, output: str) -> tuple[Sensitivity, ...]:
    """Return the elementary effects on an output for each combination of swept values."""
    _require_design(study, "morris")
    return tuple(_of_runs(study, group, runs, output, "morris") for group, runs in groups_of(study.runs))


def surrogate_indices(study: StudyResult, output: str) -> tuple[Sensitivity, ...]:
    """Return the Sobol indices of a surrogate of the output, for each combination of swept values.

    Their intervals are those of the indices of the surrogate; how far it is from the runs its validation says.
    """
    _require_samples(study)
    return tuple(_of_surrogate(group, runs, output) for group, runs in groups_of(study.runs))


def _of_runs(
    study: StudyResult, group: Mapping[str, Any], runs: Sequence[RunResult], output: str, method: str
) -> Sensitivity:
    """Compute indices from the complete blocks of a design."""
    design, paths = study.design, tuple(study.design["paths"])
    shares = draw_shares(design["method"], design["count"], len(paths), design["seed"])
    values = np.full(len(shares), np.nan)
    for run in runs:
        value = required_output(run, output).value
        values[int(run.swept[SAMPLE]) - 1] = np.nan if value is None else value
    size = block_size(design["method"], len(paths))
    whole = np.isfinite(values.reshape(-1, size)).all(axis=1)
    blocks, used = int(whole.sum()), np.repeat(whole, size)
    if blocks < _LEAST_BLOCKS:
        fault, allowed = f"has {blocks} whole blocks with {output}", f"needs {_LEAST_BLOCKS} or more"
        raise InputError("study", fault, allowed, "finish its runs")
    values = values[used]
    if method == "sobol" and np.ptp(values) == 0.0:
        raise InputError("of", f"'{output}' is {values[0]:.6g} in all runs", "needs an output that differs")
    indices = _sobol(paths, values) if method == "sobol" else _morris(paths, shares[used], values)
    left_out = len(whole) - blocks
    return _sensitivity((group, runs), output, values, indices, method=method, blocks=blocks, left_out=left_out)


def _of_surrogate(group: Mapping[str, Any], runs: Sequence[RunResult], output: str) -> Sensitivity:
    surrogate = fit_surrogate(runs, output)
    inputs, paths = surrogate.inputs, tuple(variable.path for variable in surrogate.inputs)
    shares = draw_shares("saltelli", _ON_SURROGATE, len(paths), _SEED).tolist()
    samples = ({entry.path: entry.at(share) for entry, share in zip(inputs, row, strict=True)} for row in shares)
    indices = _sobol(paths, surrogate.means(np.array([encode(inputs, sample) for sample in samples])))
    values = np.array([number for run in runs if (number := required_output(run, output).value) is not None])
    return _sensitivity((group, runs), output, values, indices, method="sobol", surrogate=surrogate.validation)


def _sensitivity(
    samples: tuple[Mapping[str, Any], Sequence[RunResult]],
    output: str,
    values: Array,
    indices: Sequence[Index],
    **others: Any,
) -> Sensitivity:
    group, runs = samples
    quantity = required_output(runs[0], output)
    return Sensitivity(
        output=output,
        label=quantity.label,
        unit=quantity.unit,
        group=dict(group),
        indices=tuple(sorted(indices, key=lambda index: -index.size)),
        mean=float(values.mean()),
        deviation=float(values.std(ddof=1)),
        runs=values.size,
        **others,
    )


def _sobol(paths: Sequence[str], values: Array) -> list[Index]:
    indices = _salib("sobol").analyze(_problem(paths), values, calc_second_order=False, **_OPTIONS)
    columns = (np.asarray(indices[name], dtype=float).tolist() for name in ("ST", "ST_conf", "S1", "S1_conf"))
    return [Index(path, *numbers) for path, *numbers in zip(paths, *columns, strict=True)]


def _morris(paths: Sequence[str], shares: Array, values: Array) -> list[Index]:
    effects = _salib("morris").analyze(_problem(paths), shares, values, **_OPTIONS)
    columns = (np.asarray(effects[name], dtype=float).tolist() for name in ("mu_star", "mu_star_conf", "sigma", "mu"))
    return [
        Index(path, size, error, deviation, mean=mean)
        for path, size, error, deviation, mean in zip(paths, *columns, strict=True)
    ]


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


def _salib(method: str) -> Any:
    try:
        return importlib.import_module(f"SALib.analyze.{method}")
    except ImportError:
        fault, repair = "needs SALib, which is not installed", "pip install 'fingerslip[sensitivity]'"
        raise InputError("sensitivity", fault, "is an optional part", repair) from None
