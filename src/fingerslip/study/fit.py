"""The sampled values of a study fitted to measured curves: its runs, the posterior, and what it predicts."""

from __future__ import annotations

import logging
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import InputError, Mistakes, ResultError, errors_at, optional_module
from fingerslip.history import is_solid, read_history
from fingerslip.libraries import pd
from fingerslip.model.programme import Slide, phase_duration
from fingerslip.parameters.schema import require_kind
from fingerslip.report.labels import path_labels
from fingerslip.report.tables.runs import table_frame
from fingerslip.results import ABOUT, FIT, HISTORY, RunResult, StudyResult, stored_fit
from fingerslip.sampling import posterior as posteriors
from fingerslip.sampling.curves import FORCES, OVER, FitSettings, Measurement, column_unit, curves_of, read_measurement
from fingerslip.sampling.designs import required_output
from fingerslip.sampling.posterior import Chain
from fingerslip.sampling.sensitivity import number_and_unit
from fingerslip.storage.files import csv_text, digest, frame_csv, new_folder, write_bytes, write_json, write_text
from fingerslip.study.definition.runs import plan_study
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import run_plans, write_up
from fingerslip.study.storage.reporting import read_results
from fingerslip.tables.table import Cell, Column, Missing, Table, to_csv

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_LEAST_WITH_EVENT = 10
_DRAWN = {"posterior": "posterior.csv", "fit": "curves.csv"}  # what figures are drawn of
_SAVED = 2000  # samples of the posterior in its file, and whose curves are drawn
_EDGE, _LEANING = 0.02, 0.1  # share of a range, and of a posterior that leans against it
# A largest value over that of the nearest run, and a correlation with the runs, which no values in a range mend; and
# how many standard deviations the largest value needs for that to be said.
_FAR, _AGAINST, _CLEAR = 30.0, 0.0, 10.0
_TELLS_LITTLE, _TOGETHER = 0.8, 0.9
# How often chi-squared is larger by chance where that is said. At a sample of the posterior of p values it is that of
# the best fit to n points, with n - p degrees of freedom, and that of the sample from it, with p: n, as at the truth.
_BY_CHANCE = 1e-3
_EVENTS = ("incipient_slip", "overall_slip", "latency")
_PERCENTS = (50.0, 16.0, 84.0, 2.5, 97.5)
_INTERVALS = ("median", "68 % from", "68 % to", "95 % from", "95 % to")


@dataclass(frozen=True)
class Posterior:
    """What a measurement says of the sampled values of a study.

    Parameters
    ----------
    folder : Path
        Folder of the tables ``posterior.csv``, ``summary.csv``, ``predictions.csv`` and ``curves.csv``, and of figures.
    tables : tuple of Table
        Values with their intervals, and predictions.

    Examples
    --------
    The modulus with its interval of 68 %::

        posterior = fs.fit("finger.yaml", "indentation.csv")
        posterior.summary[["value", "median", "68 % from", "68 % to"]]
    """

    folder: Path
    tables: tuple[Table, Table]

    @property
    def summary(self) -> pd.DataFrame:
        """A row for each value: intervals, the share of the prior's width that is left; and chi-squared per point."""
        return table_frame(self.tables[0])

    @property
    def predictions(self) -> pd.DataFrame:
        """A row for each slip time and derived quantity, with intervals that contain the emulator's error."""
        return table_frame(self.tables[1])

    @property
    def samples(self) -> pd.DataFrame:
        """Samples of the posterior: columns named by path and unit."""
        return pd.read_csv(self.folder / _DRAWN["posterior"])


def fit(
    study: str | Path,
    data: str | Path,
    *,
    results_dir: str | Path = "results",
    workers: int = 2,
    progress: StudyProgress | None = None,
) -> Posterior:
    """Fit the sampled values of a study to measured curves.

    The runs of the study are computed as by :func:`run_study`, but for those that are finished.

    Parameters
    ----------
    study : path
        The study file, with `sample` (ranges) and `fit` (curves).
    data : path
        CSV file of the measurement; its columns have units, such as ``depth [mm]``.
    results_dir : path, optional
        Folder that holds a folder for each study.
    workers : int, optional
        Number of cores.
    progress : StudyProgress, optional
        Receives the progress of the study; without it nothing is shown.

    Returns
    -------
    Posterior
        Where its files are, and its tables.

    Raises
    ------
    InputError
        For mistakes in study and data, for too few runs, and for ranges against whose ends the posterior leans.
    StudyFailedError
        Where runs failed, after the others are finished.

    Examples
    --------
    How long is there to react, after what an indentation said of the tissue::

        fs.fit("finger.yaml", "indentation.csv").predictions
    """
    for name, path in (("study", study), ("data", data)):
        require_kind(path, (str, os.PathLike), "the path of a file", f"fit: {name}")
    source = Path(study)
    plan = plan_study(source, results_dir)
    settings, sample = plan.study.fit, plan.study.sample
    if settings is None or sample is None:
        repair = "write fit: {over: depth, columns: {normal_force: 10 mN}}"
        raise InputError(f"{source}: fit", "is missing", "needs the measured curves", repair)
    optional_module(*posteriors.EMCEE)
    measurement = read_measurement(Path(data), settings)
    with errors_at(str(source)):
        for run_study, name in ((run.study, run.name) for run in plan.runs):
            phases, contact = run_study.programme, run_study.contact
            reaches = {
                "depth": sum(getattr(phase, "depth", max(getattr(phase, "press", 0.0), 0.0)) for phase in phases),
                "displacement": sum(phase.distance for phase in phases if isinstance(phase, Slide)),
                "time": run_study.time.end or sum(map(phase_duration, phases)),
            }
            # A plate with a motion or a drive of its own goes elsewhere; without a slide, what reads curves says so.
            moves_alone = contact and (contact.programme or contact.drive or run_study.bodies or run_study.reaction)
            if contact and reaches[measurement.over] and not moves_alone:
                measurement.check_reach(0.0, reaches[measurement.over], name)
    (result,) = run_plans([plan], workers=workers, progress=progress)
    with errors_at(str(source)):
        posterior = _write(result, measurement, settings)
    write_up(plan)
    return posterior


def _write(study: StudyResult, measurement: Measurement, settings: FitSettings) -> Posterior:
    """Fit the runs of a study to measured curves, and write what comes out."""
    from fingerslip.report.figures.fit import MOST_PANELS, corner_figure, fit_figure
    from fingerslip.report.figures.style import figure_bytes

    labels, units, (low, high) = _axes(study)
    numbers = [[number_and_unit(run.sampled[path])[0] for path in study.ranges] for run in study.runs]
    points = (np.array(numbers) - low) / (high - low)
    histories = ((run, read_history(study.folder / run.name / HISTORY)) for run in study.runs)
    each = (
        (curves_of(history, measurement, run.name), history["time"].values[-1], is_solid(history))
        for run, history in histories
    )
    curves, ends, are_solid = map(np.array, zip(*each, strict=True))
    end = float(ends.max())
    _refuse_far(measurement, curves)
    emulator = posteriors.fit_emulator(points, measurement.in_deviations(curves))
    likelihood = posteriors.Likelihood(emulator, measurement, settings.discrepancy)
    chain = posteriors.sample_posterior(likelihood, len(low))
    misfits = likelihood.misfit(chain.samples[:, :-1], chain.samples[:, -1])[0] / measurement.values.size
    interval = np.percentile(chain.samples[:, -1], (50.0, 2.5, 97.5)).tolist()
    warnings = noise_warning(float(np.median(misfits)), measurement.values.size), discrepancy_warning(*interval)
    if warning := " ".join(filter(None, warnings)):
        logging.getLogger("fingerslip.study").warning(warning)
    _refuse_leaning(chain.samples[:, :-1], study, settings.bounds)

    generator = np.random.default_rng(1)
    values = np.column_stack((low + chain.samples[:, :-1] * (high - low), chain.samples[:, -1]))
    note = f"Emulator of the curves: error {emulator.error:.2g} standard deviations of the measurement. "
    note += f"WARNING: {warning} " if warning else ""
    if not are_solid.any() and not set(FORCES).isdisjoint(measurement.columns):
        note += "Forces of a section go with its depth: at half the depth, twice the moduli fit as well. "
    columns, names = np.column_stack((values, misfits)), ([*labels, "chi-squared per point"], [*units, ""])
    tables = (
        _summary(columns, chain, (low, high), names, note),
        _predictions(study.runs, points, chain.samples[:, :-1], generator, end),
    )
    rows = generator.permutation(len(values))
    saved, drawn_samples = values[rows[:_SAVED]], chain.samples[rows[:_SAVED]]
    size = measurement.positions.size
    models = emulator.draw(drawn_samples[:, :-1], generator, MOST_PANELS * size).reshape(len(saved), -1, size)
    noise = generator.standard_normal(models.shape)
    root = np.linalg.cholesky(posteriors.discrepancy(measurement.positions) + 1e-9 * np.eye(size))
    smooth = drawn_samples[:, -1:, None] * generator.standard_normal(models.shape) @ root.T
    deviations = measurement.deviations[: models.shape[1]]
    bands = _curve_table(measurement, curves, *(deviations * each for each in (models, models + smooth + noise)))
    with new_folder(study.folder / FIT) as folder:
        headings = [f"{path} [{unit}]" if unit else path for path, unit in zip(study.ranges, units, strict=False)]
        cells = [[f"{value:.6g}" for value in row] for row in saved.tolist()]
        write_text(folder / _DRAWN["posterior"], csv_text([[*headings, f"discrepancy [{units[-1]}]"], *cells]))
        for name, table in zip(("summary", "predictions"), tables, strict=True):
            write_text(folder / f"{name}.csv", to_csv(table))
        write_text(folder / _DRAWN["fit"], frame_csv(bands))
        about = {"runs": digest([run.identity for run in study.runs]), "notes": [table.note for table in tables]}
        write_json(folder / Path(ABOUT).name, about)
        figures = {"corner": corner_figure(values, labels, units, (low, high)), "fit": fit_figure(bands)}
        for name, figure in figures.items():
            write_bytes(folder / f"{name}.png", figure_bytes(figure))
    return Posterior(study.folder / FIT, tables)


def _axes(study: StudyResult) -> tuple[list[str], list[str], tuple[Floats, Floats]]:
    """Return labels and units of the sampled values and of the discrepancy, and both ends of the ranges."""
    ends = [[number_and_unit(end) for end in two] for two in study.ranges.values()]
    low, high = (np.array([two[side][0] for two in ends]) for side in (0, 1))
    labels = [*path_labels(list(study.ranges)).values(), "discrepancy"]
    return labels, [*(two[0][1] for two in ends), "standard deviations"], (low, high)


def _curve_table(measurement: Measurement, runs: Floats, models: Floats, predicted: Floats) -> pd.DataFrame:
    """Return what is measured and computed of the first columns, (n, n_columns, n_positions) each [SI], in rows."""
    numbers = {"measured": measurement.values, "deviation": np.broadcast_to(measurement.deviations, runs.shape[1:])}
    for name, curves, percents in (("model", models, (5, 50, 95)), ("noisy", predicted, (5, 95))):
        quantiles = np.percentile(curves, percents, axis=0)
        numbers |= {f"{name} {percent} %": row for percent, row in zip(percents, quantiles, strict=True)}
    numbers |= {"runs from": runs.min(axis=0), "runs to": runs.max(axis=0)}
    over = f"{measurement.over} [{OVER[measurement.over]}]"
    frames = (
        pd.DataFrame({"column": name, "unit": column_unit(name), over: measurement.positions}).assign(
            **{heading: values[number] for heading, values in numbers.items()}
        )
        for number, name in enumerate(measurement.columns[: models.shape[1]])
    )
    return pd.concat(frames)


def stored_figure(folder: Path, kind: str) -> Figure:
    """Draw the posterior of a fit, or its curves, from the results of its study."""
    from fingerslip.report.figures.fit import corner_figure, fit_figure

    study, path = read_results(folder), folder / FIT / _DRAWN[kind]
    stored_fit(study)
    if not path.is_file():
        raise ResultError(f"{path}: is not there; run fingerslip fit again")
    frame = pd.read_csv(path, keep_default_na=False)
    return corner_figure(frame.to_numpy(), *_axes(study)) if kind == "posterior" else fit_figure(frame)


def _refuse_far(measurement: Measurement, curves: Floats) -> None:
    """Refuse a measurement whose unit or sign cannot be that of the runs, curves (n_runs, n_columns, n) [SI]."""
    mistakes = Mistakes()
    rows = zip(measurement.columns, measurement.values, measurement.deviations[:, 0], strict=True)
    for (name, values, deviation), ours in zip(rows, curves.swapaxes(0, 1), strict=True):
        largest, tops = float(np.abs(values).max()), np.abs(ours).max(axis=1)
        nearest = float(np.clip(largest, tops.min(), tops.max()))
        fault, unit, repair = "", column_unit(name), "look at its unit and its sign in the data"
        if max(largest, nearest) < _CLEAR * deviation:
            continue
        if not 1.0 / _FAR < largest / max(nearest, 1e-300) < _FAR:
            times = f"{largest / max(nearest, 1e-300):.3g} times that of any run"
            fault = f"the largest value is {largest:.3g} {unit}".rstrip() + f", {times}"
        elif np.corrcoef(values, ours.mean(axis=0))[0, 1] < _AGAINST and (ours @ values < 0.0).all():
            signs = ("negative", "positive") if values.sum() < 0.0 else ("positive", "negative")
            fault, repair = "is {} where that of the runs is {}".format(*signs), "reverse its sign in the data"
        if fault:
            where = f"fit.columns.{name}"
            mistakes.found.append(InputError(where, fault, "needs what the runs can come near to", repair))
    mistakes.raise_all()


def noise_warning(misfit: float, count: int) -> str:
    """Say that chi-squared per point of so many is larger than by chance; nothing where it is not."""
    from scipy.special import chdtrc

    if chdtrc(count, misfit * count) >= _BY_CHANCE:
        return ""
    factor = f"{math.sqrt(misfit):.2g}"
    return (
        f"fit.columns: residuals are {factor} times what deviations, emulator and discrepancy allow (chi-squared per "
        f"point {misfit:.3g}), needs about 1: else intervals are too narrow; write deviations {factor} times as large, "
        "or where fit.png shows a smooth misfit a larger fit.discrepancy."
    )


def discrepancy_warning(median: float, low: float, high: float) -> str:
    """Say that the discrepancy, by its median and 95 % interval, exceeds the noise; nothing where it need not."""
    if low <= 1.0:
        return ""
    return (
        f"fit.columns: runs miss the measurement smoothly by {median:.3g} ({low:.3g} to {high:.3g}) standard "
        "deviations, more than its noise, so values may be wrong beyond their intervals: look at fit.png for what the "
        "study lacks, such as a touch that is late, for which sample contact.clearance."
    )


def _refuse_leaning(samples: Floats, study: StudyResult, bounds: Sequence[str]) -> None:
    """Refuse ranges whose ends cut the posterior off, samples (n, dim) as shares of the ranges."""
    mistakes = Mistakes()
    for (path, ends), shares in zip(study.ranges.items(), samples.T, strict=True):
        for end, word, near in ((ends[0], "lower", shares < _EDGE), (ends[1], "higher", shares > 1.0 - _EDGE)):
            if near.mean() > _LEANING and path not in bounds:
                needs = "needs an end that the measurement excludes"
                fault = f"has {100.0 * near.mean():.0f} % of the posterior within {100 * _EDGE:.0f} % of {end}"
                repair = f"write a {word} end, or name the path in fit.bounds where nature ends it there"
                mistakes.found.append(InputError(f"sample.ranges.{path}", fault, needs, repair))
    mistakes.raise_all()


def _summary(
    values: Floats, chain: Chain, ranges: tuple[Floats, Floats], names: tuple[Sequence[str], Sequence[str]], note: str
) -> Table:
    """Show what the posterior says of each value, what the measurement cannot tell, and last chi-squared per point."""
    intervals = np.percentile(values, _PERCENTS, axis=0).T
    left = (intervals[:-2, 2] - intervals[:-2, 1]) / (0.68 * (ranges[1] - ranges[0]))
    nothing = Missing.NOT_DEFINED
    others = zip((*left.tolist(), nothing, nothing), (*chain.r_hat, nothing), (*chain.times, nothing), strict=True)
    cells = zip(*names, intervals.tolist(), others, strict=True)
    rows = tuple((label, unit, *interval, *more) for label, unit, interval, more in cells)
    labels, related = names[0], np.corrcoef(values[:, :-2].T).reshape(len(left), -1)
    little = [label for label, share in zip(labels, left, strict=False) if share > _TELLS_LITTLE]
    pairs = [
        f"{labels[first]} and {labels[second]} together more than each"
        for first, second in zip(*np.nonzero(np.triu(np.abs(related) > _TOGETHER, 1)), strict=True)
    ]
    note += f"The measurement says little of {', '.join(little)}. " if little else ""
    note += f"It says {'; '.join(pairs)}. " if pairs else ""
    columns = (Column("value"), Column("unit"), *(Column(name, significant=4) for name in _INTERVALS))
    more = Column("share of prior left", digits=2), Column("R-hat", digits=3), Column("autocorrelation", "steps", 0)
    return Table("What the measurement says", (*columns, *more), rows, note.strip())


def _predictions(
    runs: Sequence[RunResult], points: Floats, samples: Floats, generator: np.random.Generator, end: float
) -> Table:
    """Show slip times and derived quantities with intervals; of what not every run up to `end` [s] has, no error."""
    rows: list[tuple[Cell, ...]] = []
    for name in (*_EVENTS, *runs[0].derived):
        quantities = [required_output(run, name) for run in runs]
        has = np.array([quantity.value is not None for quantity in quantities])
        outputs = np.array([quantity.value for quantity in quantities if quantity.value is not None])
        cells: Sequence[Cell] = (Missing.NO_EVENT,) * (len(_PERCENTS) + 1)
        if has.sum() >= _LEAST_WITH_EVENT:
            middle, spread = outputs.mean(), outputs.std() or 1.0
            processes = posteriors.fit_processes(points[has], ((outputs - middle) / spread)[:, None])
            mean, variance = processes.predict(samples)
            mean += np.sqrt(variance) * generator.standard_normal(mean.shape)
            intervals = (middle + spread * np.percentile(mean, _PERCENTS)).tolist()
            is_beyond = not has.all() or (name in _EVENTS[:2] and max(intervals) > end)
            error = float(spread * np.sqrt(np.mean(processes.errors**2)))
            cells = [*intervals, Missing.NOT_DEFINED if is_beyond else error]
        rows.append((quantities[0].label, quantities[0].unit, *cells, f"{has.sum()} of {len(runs)}"))
    columns = Column("output"), Column("unit"), *(Column(name, significant=4) for name in _INTERVALS)
    extrapolated = ", ".join(str(row[0]) for row in rows if row[-2] is Missing.NOT_DEFINED)
    beyond = f" Extrapolated, as not every run has it before its end (at most {end:.4g} s) or intervals reach beyond: "
    beyond += f"{extrapolated}; let the programme go on for longer."
    return Table(
        "What the fitted model predicts",
        (*columns, Column("emulator's error", significant=2), Column("found in")),
        tuple(rows),
        "Intervals contain the emulator's error." + beyond * bool(extrapolated),
    )
