"""Measured curves that a study is fitted to, and the same curves of its runs.

A measurement is a table of columns with units: where it was measured, such as ``depth [mm]``, and what. Forces are
those of the first counterface, ``normal_force`` and ``tangential_force`` (its size). A site has its name, a point, what
was measured there and the component: ``m12.displacement_x``, ``FA-I 3.strain_xy``.
"""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.errors import InputError, Mistakes, shorten, unknown_name
from fingerslip.history import VARIABLES
from fingerslip.libraries import pd, xr
from fingerslip.parameters import parameters
from fingerslip.slip.windows import contact_forces, counterface_normal, slide_window, split_along
from fingerslip.storage.files import check_decimals
from fingerslip.units import parse_quantity, quantity_of

#: What a curve may be over, and its unit.
OVER: Mapping[str, str] = {"depth": "m", "displacement": "m", "time": "s"}
FORCES = ("normal_force", "tangential_force")
_OF_SITES = {name: variable for name, variable in VARIABLES.items() if variable.dims[:2] == ("time", "site")}
_HEADING = re.compile(r"\s*(?P<name>.+?)\s*(?:\[(?P<unit>[^\]]*)\])?\s*")
_SITE_COLUMN = re.compile(rf"(?P<site>.+)\.(?P<variable>{'|'.join(_OF_SITES)})(?:_(?P<component>[xyz]+))?")
_LEAST_ROWS, _MOST_ROWS = 5, 2000
#: Runs for each fitted value at least.
RUNS_PER_VALUE = 10


def column_unit(name: str) -> str:
    """Return the SI unit of a column by its name, or by a pattern of names; it is empty for pure numbers."""
    match = _SITE_COLUMN.fullmatch(name)
    if name not in FORCES and match is None:
        allowed = f"needs {', '.join(FORCES)} or SITE.QUANTITY_COMPONENT of {', '.join(_OF_SITES)}"
        raise InputError(name, "is no curve of a run", allowed, "write for example m1.displacement_x")
    return "N" if match is None else _OF_SITES[match["variable"]].units.replace("1", "")


def _check_columns(columns: Mapping[str, Any]) -> Mapping[str, Any]:
    mistakes = Mistakes([] if columns else [InputError("", "is empty", "needs columns", "write normal_force: 10 mN")])
    for name, deviation in columns.items():
        with mistakes.collect():
            _deviation(name, deviation)
    mistakes.raise_all()
    return columns


def _deviation(name: str, deviation: Any) -> float:
    """Return the standard deviation of a column [SI]."""
    unit = column_unit(name)
    quantity = (parse_quantity(str(deviation), unit, where=name), "") if unit else quantity_of(deviation)
    if quantity is None or quantity[1] or not 0.0 < quantity[0] < np.inf:
        raise InputError(name, f"got {shorten(repr(deviation))}", "needs a standard deviation > 0")
    return quantity[0]


@parameters
class FitSettings:
    """To which measured curves ``fingerslip fit`` fits the sampled values of a study.

    Their ranges in `sample` are the prior: every value between the ends is as likely.
    """

    over: Annotated[
        Literal["depth", "displacement", "time"],
        "Column over which the curves are: how deep the counterface was pressed, how far it has slid since the "
        "slide began, or the time since the start.",
    ]
    columns: Annotated[
        Mapping[str, Any],
        pydantic.AfterValidator(_check_columns),
        "Standard deviation of the measurement by the name of the column, or by a pattern of names such as "
        '``"*.displacement_x"``.',
    ]
    discrepancy: Annotated[
        float,
        pydantic.Field(gt=0),
        "How far the model may be off, smoothly along the curves, in standard deviations of the measurement: the "
        "scale of a half-normal prior.",
    ] = 1.0
    bounds: Annotated[
        tuple[str, ...],
        "Sampled values whose ranges end where nature ends them: the posterior may lean against the ends.",
    ] = ()


@dataclass(frozen=True)
class Measurement:
    """Measured curves."""

    over: str  # what they are over
    positions: Floats  # (n,), [SI of `over`]
    columns: tuple[str, ...]  # their names
    values: Floats  # (n_columns, n), [SI]
    deviations: Floats  # (n_columns, 1), standard deviation of each [SI]

    def in_deviations(self, curves: Floats) -> Floats:
        """Return curves (..., n_columns, n) [SI] in standard deviations, (..., n_columns n)."""
        return np.asarray(curves / self.deviations).reshape(*curves.shape[:-2], -1)

    def check_reach(self, start: float, end: float, run: str) -> None:
        """Refuse what goes beyond a run, from start to end [SI of `over`]."""
        low, high, slack = self.positions.min(), self.positions.max(), 1e-6 * (end - start)
        if low < start - slack or high > end + slack:
            unit, repair = OVER[self.over], "let the programme go further, or leave out rows"
            needs = f"needs {start:.6g} to {end:.6g} {unit}, as run {run} has"
            raise InputError(f"fit.over: {self.over}", f"goes from {low:.6g} to {high:.6g} {unit}", needs, repair)


def read_measurement(path: Path, settings: FitSettings) -> Measurement:
    """Read measured curves from a CSV file whose columns have units."""
    check_decimals(path)
    try:  # headings as a row: else pandas renames a second column of a name, and takes longer rows for an index
        rows = pd.read_csv(path, comment="#", skipinitialspace=True, header=None, dtype=str)
    except (OSError, ValueError) as error:
        fault = getattr(error, "strerror", None) or shorten(str(error))
        raise InputError(str(path), f"cannot be read ({fault})", "needs a CSV file") from None
    columns: dict[str, tuple[Any, str]] = {}
    for number, heading in rows.iloc[0].dropna().items():
        if match := _HEADING.fullmatch(heading):
            if match["name"] in columns:
                raise InputError(str(path), f"has the column '{match['name']}' twice", "needs each name once")
            columns[match["name"]] = (number, match["unit"] or "")
    deviations: dict[str, float] = {}
    for pattern, deviation in ((settings.over, None), *settings.columns.items()):
        names = [pattern] if pattern in columns else fnmatch.filter(columns, pattern)
        if not names:
            repair = f"write the first line as {_header(settings)}; it has {shorten(', '.join(columns))}"
            raise InputError(str(path), f"has no column '{pattern}'", "needs it, as the block fit says", repair)
        for name in names if deviation is not None else ():
            deviations.setdefault(name, _deviation(pattern, deviation))
    count = len(rows) - 1
    if not _LEAST_ROWS <= count <= _MOST_ROWS:
        allowed = f"needs {_LEAST_ROWS} to {_MOST_ROWS}"
        raise InputError(str(path), f"has {count} rows", allowed, "average neighbouring rows of a long recording")
    si_units = {settings.over: OVER[settings.over]} | {name: column_unit(name) for name in deviations}
    positions, *values = [
        _numbers(rows[columns[name][0]][1:], columns[name][1], si, f"{path}: column '{name}'")
        for name, si in si_units.items()
    ]
    if np.ptp(positions) == 0.0:
        raise InputError(f"{path}: column '{settings.over}'", "is the same in every row", "needs positions that differ")
    spreads = np.array(list(deviations.values()))[:, None]
    return Measurement(settings.over, positions, tuple(deviations), np.array(values), spreads)


def _header(settings: FitSettings) -> str:
    """Return the first line that a file of measurements needs, as an example."""
    shown = {"m": "mm"}
    units = {settings.over: OVER[settings.over]} | {name: column_unit(name) for name in settings.columns}
    return ",".join(f"{name} [{shown.get(unit, unit)}]" if unit else name for name, unit in units.items())


def _numbers(column: pd.Series[Any], unit: str, si: str, where: str) -> Floats:
    """Return the numbers of a column [SI], (n,)."""
    try:
        factor = 1.0 if unit in ("", "1") and not si else parse_quantity(f"1 {unit}", si)
    except InputError:
        fault = f"has the unit [{unit}]" if unit else "has no unit"
        repair = "write it behind the name, as in depth [mm]"
        raise InputError(where, fault, f"needs a unit of [{si}]", repair) from None
    numbers = factor * pd.to_numeric(column, errors="coerce").to_numpy(dtype=float)
    if not np.isfinite(numbers).all():
        row = int(np.argmin(np.isfinite(numbers))) + 1
        raise InputError(where, f"has no number in row {row}", "needs one in every row", "leave out the row")
    return numbers


def curves_of(history: xr.Dataset, measurement: Measurement, run: str) -> Floats:
    """Return the curves of a run where they were measured, (n_columns, n) [SI]."""
    positions, first = _positions(history, measurement.over, run)
    last = int(positions.argmax()) + 1
    measurement.check_reach(positions[0], positions[last - 1], run)
    curves = [_signal(history, name)[first : first + last] for name in measurement.columns]
    return np.array([np.interp(measurement.positions, positions[:last], curve) for curve in curves])


def _positions(history: xr.Dataset, over: str, run: str) -> tuple[Floats, int]:
    """Return depths, displacements or times from some record on, and its number."""
    if over == "time":
        return np.asarray(history["time"].values, dtype=float), 0
    travel = np.asarray(history["counterface_displacement"].values[:, 0], dtype=float)
    if over == "depth":
        return np.asarray(split_along(travel, counterface_normal(history))[0]), 0
    window = slide_window(history)
    if window is None:
        raise InputError("fit.over", f"is displacement, and run {run} does not slide", "needs a slide in the programme")
    along = split_along(travel[window.records] - travel[window.first], counterface_normal(history))[1]
    return np.asarray(np.linalg.norm(along, axis=1)), window.first


def _signal(history: xr.Dataset, name: str) -> Floats:
    """Return what a column measures over the time of a history, (n_times,) [SI]."""
    match = _SITE_COLUMN.fullmatch(name)
    if match is None:
        forces = contact_forces(history)
        return forces.normal if name == FORCES[0] else forces.friction
    sites = [str(site) for site in history["site"].values] if match["variable"] in history else []
    if match["site"] not in sites:
        raise unknown_name(f"fit.columns.{name}", match["site"], sites or ["sites that the study records"])
    signal = history[match["variable"]].isel(site=sites.index(match["site"]))
    for dim in signal.dims[1:]:
        components = list(map(str, signal[dim].values))
        if match["component"] not in components:
            raise unknown_name(f"fit.columns.{name}", str(match["component"]), components)
        signal = signal.isel({dim: components.index(match["component"])})
    return np.asarray(signal.values, dtype=float)
