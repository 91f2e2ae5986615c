"""A study that was run, opened from its folder: its results as a data frame, its histories when they are asked for."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fingerslip.errors import InputError
from fingerslip.history import read_history
from fingerslip.parameters.dotted import flatten
from fingerslip.parameters.schema import require_kind
from fingerslip.report.tables.runs import runs_frame
from fingerslip.results import HISTORY, RUN, RunResult, StudyResult, unchecked_result
from fingerslip.study.definition.file import read_mapping
from fingerslip.study.storage.summary import identities, read_uncertainties, stored_manifest, stored_study

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


@dataclass(frozen=True, repr=False)
class OpenedStudy:
    """The results of a study, read as far as they are needed.

    Parameters
    ----------
    result : StudyResult
        Its runs with their events and measures, without the values of their ``run.yaml``.

    Examples
    --------
    Overall slip against friction, and the history of one run::

        study = fs.open_study("results/wang2014_friction")
        frame = study.to_dataframe()
        frame.plot("contact.friction_coefficient", "overall_s")
        history = study.history("friction_coefficient-0.6")
    """

    result: StudyResult

    @property
    def folder(self) -> Path:
        """The folder of the results."""
        return self.result.folder

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the finished runs."""
        return tuple(run.name for run in self.result.runs)

    def run(self, name: str) -> RunResult:
        """Return the result of a run with all its values.

        Raises
        ------
        InputError
            For a name that no finished run has.
        """
        result = next((run for run in self.result.runs if run.name == name), None)
        if result is None:
            raise InputError("run", f"'{name}' is not a finished run", f"needs one of {', '.join(self.names)}")
        return dataclasses.replace(result, values=flatten(read_mapping(self.folder / name / RUN)))

    def history(self, name: str) -> xr.Dataset:
        """Return the history of a run, read from its file.

        Raises
        ------
        InputError
            For a name that no finished run has.
        ResultError
            Where the file is damaged.
        """
        return read_history(self.folder / self.run(name).name / HISTORY)

    def histories(self) -> Iterator[tuple[str, xr.Dataset]]:
        """Yield the name and the history of every run, one at a time."""
        for name in self.names:
            yield name, read_history(self.folder / name / HISTORY)

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row for each run, in SI units: see :func:`~fingerslip.report.tables.runs.runs_frame`."""
        return runs_frame(self.result)

    def __len__(self) -> int:
        return len(self.result.runs)

    def __repr__(self) -> str:
        return f"<OpenedStudy {self.result.title!r}: {len(self)} runs in {self.folder}>"

    def _repr_html_(self) -> str:
        """Return the study as notebooks show it."""
        return self.to_dataframe().dropna(axis="columns", how="all").to_html(max_rows=20)


def open_study(folder: str | Path) -> OpenedStudy:
    """Open the results of a study.

    Only the small files of the runs are read, and their checksums are those files' own; histories are read when they
    are asked for.

    Parameters
    ----------
    folder : path
        Folder of the results of a study, as ``fingerslip run`` leaves it.

    Returns
    -------
    OpenedStudy
        The study.

    Raises
    ------
    InputError
        For what is no path.
    ResultError
        Where the folder holds no results of a study, or one of its files is damaged.
    """
    require_kind(folder, (str, os.PathLike), "the path of a folder", "open_study")
    folder = Path(folder)
    manifest = stored_manifest(folder)
    uncertainties = read_uncertainties(folder, identities(manifest))
    runs = (unchecked_result(folder / name) for name in manifest["runs"])
    known_runs = (dataclasses.replace(run, uncertainty=uncertainties.get(run.name, {})) for run in runs)
    return OpenedStudy(stored_study(folder, manifest, known_runs))
