"""Studies in Python: made, run, and opened again."""

from __future__ import annotations

import copy
import dataclasses
import functools
import html
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerslip.errors import InputError
from fingerslip.history import read_history
from fingerslip.libraries import pd, xr
from fingerslip.parameters import as_mapping
from fingerslip.parameters.dotted import assign, flatten
from fingerslip.parameters.schema import require_kind
from fingerslip.report.tables.runs import runs_frame, table_frame
from fingerslip.results import HISTORY, RUN, RunResult, StudyResult, stored_result
from fingerslip.study.definition.file import read_mapping, read_with_base, write_mapping
from fingerslip.study.definition.runs import Plan, plan_mapping
from fingerslip.study.definition.spec import Study as Definition
from fingerslip.study.running.progress import StudyProgress, progress_on_screen
from fingerslip.study.running.runner import run_plans
from fingerslip.study.shipped import example_path
from fingerslip.study.storage.reporting import warn_of_doubts
from fingerslip.study.storage.store import stored_study

if TYPE_CHECKING:
    from fingerslip.model.model import Model


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
        """Return the result of a run with all its values; a name that no finished run has is refused."""
        result = next((run for run in self.result.runs if run.name == name), None)
        if result is None:
            raise InputError("run", f"'{name}' is not a finished run", f"needs one of {', '.join(self.names)}")
        return dataclasses.replace(result, values=flatten(read_mapping(self.folder / name / RUN)))

    def history(self, name: str) -> xr.Dataset:
        """Return the history of a run, read from its file; raise ResultError where that is damaged."""
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
    return OpenedStudy(stored_study(Path(folder), functools.partial(stored_result, is_whole=True)))


@dataclass(frozen=True, repr=False, eq=False)
class Study:
    """A study: one model and the values that are swept, ready to be checked and run.

    Parameters
    ----------
    base : path, mapping or Study
        Where it starts: a study file, the name of a shipped study, what a study file holds as plain data (quantities as
        text with units), or another study.
    sweep : mapping of str to sequence, optional
        Values by dotted path, instead of those of the base; arrays of NumPy are lists. Several paths with commas
        between them name values that change together.
    sample : mapping, optional
        Samples of values that are known by their ranges only, instead of those of the base.
    changes : mapping of str to object, optional
        Other values by dotted path.
    name : str, optional
        Name of the folder of its results; without it that of its base.

    Raises
    ------
    InputError
        Where the base is no study. What is wrong with its values :meth:`check` and :meth:`run` say.

    Examples
    --------
    Overall slip against friction::

        frictions = np.linspace(0.3, 0.9, 7)
        study = fs.Study("wang2014_table2", sweep={"contact.friction_coefficient": frictions}, name="friction")
        study.check()
        frame = study.run(workers=2).to_dataframe()
        frame.plot("contact.friction_coefficient", "overall_s")
    """

    base: str | Path | Mapping[str, Any] | Definition | Study
    sweep: Mapping[str, Sequence[Any]] | None = None
    sample: Mapping[str, Any] | None = None
    changes: Mapping[str, Any] | None = None
    name: str | None = None

    def __post_init__(self) -> None:
        kinds = (str, os.PathLike, Mapping, Definition, Study)
        require_kind(self.base, kinds, "a path, a name, a mapping or a Study", "Study.base")
        if self.name is not None and (self.name in ("", "..") or Path(self.name).name != self.name):
            raise InputError("Study.name", f"got {self.name!r}", "needs the name of a folder, without its path")

    @property
    def source(self) -> Path:
        """The study file that errors name and beside which mesh files are looked for; it need not exist."""
        if isinstance(self.base, Study):
            return self.base.source
        if isinstance(self.base, Mapping | Definition):
            return Path(f"{self.name or 'study'}.yaml")
        return _file(self.base)

    @property
    def mapping(self) -> dict[str, Any]:
        """All that it says, as plain data that a study file could hold."""
        result: dict[str, Any]
        match self.base:
            case Study():
                result = self.base.mapping
            case Definition():
                result = as_mapping(self.base)
            case Mapping():
                result = _plain(self.base)
            case _:
                result = read_with_base(_file(self.base))
        for path, value in (self.changes or {}).items():
            try:
                assign(result, path, _plain(value))
            except LookupError:
                where = f"Study.changes.{path}"
                raise InputError(where, "leads nowhere", "needs the dotted path of a value") from None
        result |= {
            key: _plain(values)
            for key, values in (("sweep", self.sweep), ("sample", self.sample))
            if values is not None
        }
        return result

    @property
    def folder_name(self) -> str:
        """Name of the folder of its results."""
        inherited = self.base.folder_name if isinstance(self.base, Study) else self.source.stem
        return self.name or inherited

    def check(self, results: str | Path = "results") -> pd.DataFrame:
        """Check it without computing anything.

        Parameters
        ----------
        results : path, optional
            Folder that holds a folder for each study, in which finished runs are found.

        Returns
        -------
        pandas.DataFrame
            A row for each run: its state, size and estimated time; ``attrs["note"]`` says what all runs take together.

        Raises
        ------
        InputError
            For all mistakes in the study.
        """
        # What builds meshes and models is slow to load.
        from fingerslip.study.inspection.check import check_plans

        return table_frame(check_plans([self._plan(results)]))

    def run(
        self,
        results: str | Path = "results",
        *,
        workers: int = 2,
        force: bool = False,
        progress: bool | StudyProgress = False,
        scheduler: str | None = None,
    ) -> OpenedStudy:
        """Compute its runs, but for those that are finished with the same values, and write them up.

        Parameters
        ----------
        results : path, optional
            Folder that holds a folder for each study.
        workers : int, optional
            Number of cores: so many runs are computed at once, each in its own process.
        force : bool, optional
            Compute finished runs again too.
        progress : bool or StudyProgress, optional
            Whether progress is shown on standard error, or what receives it.
        scheduler : str, optional
            Address of a Dask scheduler, such as ``tcp://host:8786``, whose workers compute instead of local processes.

        Returns
        -------
        OpenedStudy
            Its results.

        Raises
        ------
        InputError
            For all mistakes in the study, before anything is written.
        StudyFailedError
            Where runs failed, after the others are finished.
        ResultError
            Where results cannot be written.
        """
        if isinstance(progress, bool):
            progress = progress_on_screen() if progress else StudyProgress()
        plan = self._plan(results)
        (result,) = run_plans([plan], workers=workers, force=force, progress=progress, scheduler=scheduler)
        warn_of_doubts(result)
        return open_study(plan.folder)

    def save(self, path: str | Path) -> Path:
        """Write it as a study file, for ``fingerslip run``; a mesh file is looked for beside it."""
        write_mapping(self.mapping, Path(path))
        return Path(path)

    def _plan(self, results: str | Path) -> Plan:
        return plan_mapping(self.mapping, self.source, Path(results) / self.folder_name)

    def __repr__(self) -> str:
        title, swept = _summary(self.mapping)
        return f"<Study {title!r}: {', '.join(f'{path} ({words})' for path, words in swept) or 'one run'}>"

    def _repr_html_(self) -> str:
        """Return the study as notebooks show it: its title and what it sweeps."""
        title, swept = _summary(self.mapping)
        rows = "".join(f"<tr><td>{html.escape(path)}</td><td>{html.escape(words)}</td></tr>" for path, words in swept)
        head = "<tr><th>value</th><th>in the runs</th></tr>"
        return f"<b>Study: {html.escape(title)}</b><table>{head}{rows}</table>"


def study_model(study: str | Path | Mapping[str, Any] | Definition | Study, run: str | None = None) -> Model:
    """Make the model of a run of a study, to be simulated or stepped from Python.

    Parameters
    ----------
    study : path, mapping or Study
        Whatever :class:`Study` starts from: a study file, the name of a shipped study, plain data, or a study.
    run : str, optional
        Name of the run, such as ``friction_coefficient-0.4``; not needed where there is only one.

    Returns
    -------
    Model
        The model, with its mesh built or read.

    Raises
    ------
    InputError
        For all mistakes in the study, and for a run that it does not have.

    Examples
    --------
    Step a TacTip on a plate::

        model = fs.study_model("tactip_slide")
        with fs.Simulation(model) as sim:
            seen = sim.step()
    """
    # What builds meshes and models is slow to load.
    from fingerslip.study.running.build import build_model

    source = Study(study)
    plan = plan_mapping(source.mapping, source.source, Path(source.folder_name))
    names = [element.name for element in plan.runs]
    if run is None and len(names) == 1:
        return build_model(plan.runs[0])
    if run not in names:
        fault = "is missing" if run is None else f"{run!r} is not a run of {plan.source}"
        raise InputError("study_model.run", fault, f"needs one of {', '.join(names)}")
    return build_model(plan.runs[names.index(run)])


def _file(base: str | os.PathLike[str]) -> Path:
    """Return the study file of a path or of a shipped study's name; a file that is there comes first."""
    path = Path(base)
    shipped = None if path.exists() or path.name != str(base) or path.suffix else example_path(str(base))
    return shipped or path


def _plain(value: Any) -> Any:
    """Return lists, dictionaries and scalars of Python only, as files hold them."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, str | bytes) or not isinstance(value, Sequence):
        return copy.deepcopy(value)
    return [_plain(item) for item in value]


def _summary(mapping: Mapping[str, Any]) -> tuple[str, list[tuple[str, str]]]:
    """Return the title of a study, and what changes from run to run in words."""
    sample = mapping.get("sample") or {}
    swept = [(path, f"{len(values)} values") for path, values in (mapping.get("sweep") or {}).items()]
    swept += [(path, f"{ends[0]} to {ends[1]}") for path, ends in (sample.get("ranges") or {}).items()]
    swept += [(path, f"{len(values)} choices") for path, values in (sample.get("choices") or {}).items()]
    return str(mapping.get("title") or "without a title"), swept
