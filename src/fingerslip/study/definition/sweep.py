"""Sweeps: the runs of a study, each with all its values and a name for its folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingerslip.parameters import as_mapping
from fingerslip.specimens.protocol import Specimen
from fingerslip.study.definition.names import run_names
from fingerslip.study.definition.spec import NOT_OF_A_RUN, Study, parse_study, study_mapping
from fingerslip.study.definition.swept import combinations, with_values

__all__ = ["Run", "expand"]


@dataclass(frozen=True)
class Run:
    """One run of a study.

    Parameters
    ----------
    name : str
        Name of its folder, from the swept values.
    where : str
        Its name in errors: the study file, and the swept values.
    swept : mapping of str to object
        The swept values by dotted path, as the study file writes them.
    study : Study
        The study with these values, without a sweep.
    specimen : Specimen or None
        The specimen with all its values.
    """

    name: str
    where: str
    swept: Mapping[str, Any]
    study: Study
    specimen: Specimen | None

    def resolved(self) -> dict[str, Any]:
        """Return everything that makes the run as plain data, which is a study file of its own."""
        mapping = study_mapping(self.study)
        kind = self.study.specimen_kind
        if kind is not None:
            mapping[kind] = {"preset": mapping[kind]["preset"], **as_mapping(self.specimen)}
        named = f"{mapping['title']}: {self.name}" if self.swept else mapping["title"]
        kept = {key: value for key, value in mapping.items() if key not in ("title", *NOT_OF_A_RUN)}
        result: dict[str, Any] = _without_empty({"title": named, **kept})
        return result


def expand(study: Study, source: Path) -> tuple[Run, ...]:
    """Return the runs of a study, all of them checked; the first swept path varies slowest.

    Parameters
    ----------
    study : Study
        The study.
    source : Path
        Its file, which errors name and to which paths of mesh files are relative.

    Raises
    ------
    InputError
        For all swept paths that do not exist, and all values that do not fit there.
    """
    parse_study(study_mapping(study), source)
    swept = combinations(study.sweep)
    return tuple(_run(study, values, name, source) for values, name in zip(swept, run_names(swept), strict=True))


def _run(study: Study, swept: Mapping[str, Any], name: str, source: Path) -> Run:
    one = parse_study(with_values(study_mapping(study), swept), source)
    values = ", ".join(f"{path} = {value}" for path, value in swept.items())
    where = f"{source} ({values})" if swept else str(source)
    return Run(name, where, dict(swept), one, one.specimen(str(source)))


def _without_empty(value: Any) -> Any:
    """Leave out what was not given, so that the written run reads like a study file."""
    if isinstance(value, Mapping):
        return {key: _without_empty(item) for key, item in value.items() if item is not None and item not in ({}, [])}
    return [_without_empty(item) for item in value] if isinstance(value, list) else value
