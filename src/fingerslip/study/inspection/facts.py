"""What was run, as ``fingerslip cite`` tells it: values by path, meshes and results of a run or a study."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fingerslip.history import read_history
from fingerslip.libraries import xr
from fingerslip.report.tables.parameters import DEFAULT, NOT_USED, ShownValue
from fingerslip.results import HISTORY, RUN, StudyResult
from fingerslip.study.definition.runs import Run
from fingerslip.study.storage import reporting
from fingerslip.study.storage.reporting import SWEPT
from fingerslip.study.storage.store import read_manifest
from fingerslip.units import Unit


@dataclass(frozen=True)
class Facts:
    """What was run."""

    values: Mapping[str, ShownValue]  # by path, without those that are not used
    runs: Sequence[Run]  # what was to be run
    histories: Sequence[xr.Dataset]  # one for each mesh
    study: StudyResult  # the results
    commit: str  # of the program

    def text(self, path: str) -> str:
        """Return a value as text; empty where there is none."""
        return self.values[path].value if path in self.values else ""

    def matching(self, pattern: str, *, only_set: bool = False) -> dict[str, str]:
        """Return the values whose paths begin with a pattern, by path; only those of the study file if asked."""
        return {
            path: value.value
            for path, value in self.values.items()
            if re.match(pattern, path) and not (only_set and value.source == DEFAULT)
        }

    def below(self, group: str, *, only_set: bool = False) -> dict[str, str]:
        """Return the values below a path, by what their paths have after it; see :meth:`matching`."""
        values = self.matching(rf"{re.escape(group)}\.", only_set=only_set)
        return {path.removeprefix(f"{group}."): text for path, text in values.items()}

    def span(self, name: str, unit: Unit | None = None) -> str:
        """Return a property of the meshes, or the smallest and the largest of them."""
        numbers = sorted({float(history.attrs[name]) for history in self.histories if name in history.attrs})
        texts = [f"{number:,.10g}" if unit is None else unit.format(float(f"{number:.3g}")) for number in numbers]
        return " to ".join(dict.fromkeys((texts[0], texts[-1]))) if texts else ""

    def largest(self, name: str) -> float | None:
        """Return the largest of a number of the runs."""
        numbers = (run.numbers.get(name) for run in self.study.runs)
        return max((float(number) for number in numbers if number is not None), default=None)


def read_facts(folder: Path) -> Facts:
    """Read what was run from the folder of a run or of a study."""
    manifest = read_manifest(folder)
    if manifest.get("runs"):
        study, folders = reporting.read_results(folder), {name: folder / name for name in manifest["runs"]}
    else:
        run = reporting.read_stored_run(folder)
        study, folders = StudyResult(folder, (), (run,)), {run.name: folder}
        manifest = read_manifest(folder.parent)
    runs = [reporting.read_run_values(folders[run.name] / RUN) for run in study.runs]
    rows = reporting.value_rows(runs, manifest.get("given") or None)
    # One history for each mesh says how large it is and how it was solved.
    meshes = {run.mesh_hash: folders[run.name] for run in reversed(study.runs)}
    histories = tuple(read_history(path / HISTORY) for path in reversed(meshes.values()))
    ranges = {path: " to ".join(map(str, ends)) for path, ends in study.ranges.items()}
    values = {row.path: _in_a_sentence(row) for row in rows if row.source != NOT_USED}
    values |= {path: dataclasses.replace(values[path], value=text) for path, text in ranges.items() if path in values}
    return Facts(values, runs, histories, study, str(manifest.get("commit") or ""))


def _in_a_sentence(value: ShownValue) -> ShownValue:
    """Return a value that differs between runs with "and" before its last one, unless some are left out."""
    last = r", (?!…)(?=[^,()]*$|\([^()]*\)$)"
    return dataclasses.replace(value, value=re.sub(last, " and ", value.value)) if value.source == SWEPT else value
