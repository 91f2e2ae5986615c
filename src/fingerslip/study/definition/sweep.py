"""Sweeps and samples: the runs of a study, each with all its values and a name for its folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fingerslip.errors import InputError
from fingerslip.materials.choice import PRESET, material_of
from fingerslip.parameters import as_mapping
from fingerslip.parameters.dotted import flatten
from fingerslip.results import REPEAT, SAMPLE, RefusedRun
from fingerslip.specimens.protocol import Specimen
from fingerslip.study.definition.names import run_names
from fingerslip.study.definition.sampled import RepeatSettings, SampleSettings, drawn, scatter_values
from fingerslip.study.definition.spec import NOT_OF_A_RUN, Study, parse_study, study_mapping
from fingerslip.study.definition.swept import combinations, with_values

__all__ = ["Expansion", "Run", "expand", "expand_known", "expand_samples"]


@dataclass(frozen=True)
class Run:
    """One run of a study."""

    name: str  # name of its folder, from the swept values and the number of the sample
    where: str  # its name in errors: the study file, the swept values and the number of the sample
    swept: Mapping[str, Any]  # the swept values by dotted path, as the study file writes them
    study: Study  # the study with these values, without a sweep and without samples
    specimen: Specimen | None  # the specimen with all its values
    sampled: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))

    def plain_values(self) -> dict[str, Any]:
        """Return everything that makes the run as plain data, which is a study file of its own."""
        return dict(self._all_values)

    @cached_property
    def _all_values(self) -> dict[str, Any]:
        mapping = study_mapping(self.study)
        kind = self.study.specimen_kind
        if kind is not None:
            mapping[kind] = {"preset": mapping[kind]["preset"], **self._specimen_values(mapping[kind])}
        for name, entry in self.study.materials.items():
            if isinstance(entry, Mapping):
                mapping["materials"][name] = {PRESET: entry[PRESET], **as_mapping(material_of(entry))}
        named = f"{mapping['title']}: {self.name}" if self.swept else mapping["title"]
        run_values = {key: value for key, value in mapping.items() if key not in ("title", *NOT_OF_A_RUN)}
        result: dict[str, Any] = _without_empty({"title": named, **run_values})
        return result

    def _specimen_values(self, written: Mapping[str, Any]) -> dict[str, Any]:
        """Return all values of the specimen; a material that starts from one that ships keeps its name."""
        values: dict[str, Any] = as_mapping(self.specimen)
        for name, element in (written.get("materials") or {}).items():
            if PRESET in element:
                values["materials"][name] = {PRESET: element[PRESET], **values["materials"][name]}
        return values


@dataclass(frozen=True)
class _Named:
    """What tells a run from the others."""

    name: str
    swept: Mapping[str, Any]
    sampled: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True)
class Expansion:
    """The runs that a study makes."""

    runs: tuple[Run, ...]  # the runs, all of them checked
    refused: tuple[RefusedRun, ...] = ()  # samples whose values do not fit together


def expand(study: Study, source: Path) -> tuple[Run, ...]:
    """Return the runs of a study, all of them checked, without refused samples; see :func:`expand_samples`."""
    return expand_samples(study, source).runs


def expand_samples(study: Study, source: Path) -> Expansion:
    """Return the runs of a study; the first swept path varies slowest, samples vary fastest."""
    parse_study(study_mapping(study), source)
    return expand_known(study, source)


def expand_known(study: Study, source: Path) -> Expansion:
    """Return the runs of a study whose swept paths and values are known to be right; see :func:`expand_samples`."""
    swept = combinations(study.sweep)
    if study.repeats is not None:
        return _with_repeats(study, study.repeats, swept, source)
    if study.sample is None:
        named = [_Named(name, values) for values, name in zip(swept, run_names(swept), strict=True)]
        mapping = study_mapping(study)
        return Expansion(tuple(_run(mapping, named_run.swept, source, named_run) for named_run in named))
    return _with_samples(study, study.sample, swept, source)


def _with_samples(study: Study, settings: SampleSettings, swept: list[dict[str, Any]], source: Path) -> Expansion:
    samples = tuple(enumerate(drawn(settings), start=1))
    digits = len(str(settings.total))
    pairs = [(values, number, sampled) for values in swept for number, sampled in samples]
    names = run_names([{**values, SAMPLE: f"{number:0{digits}}"} for values, number, _ in pairs])
    return _possible(
        study,
        source,
        [
            (_Named(name, {**values, SAMPLE: number}, sampled), {**values, **settings.values(sampled)})
            for (values, number, sampled), name in zip(pairs, names, strict=True)
        ],
    )


def _with_repeats(study: Study, settings: RepeatSettings, swept: list[dict[str, Any]], source: Path) -> Expansion:
    numbers, digits = range(1, settings.count + 1), len(str(settings.count))
    pairs = [(values, number) for values in swept for number in numbers]
    names = iter(run_names([{**values, REPEAT: f"{number:0{digits}}"} for values, number in pairs]))
    named, mapping = [], study_mapping(study)
    for values in swept:
        values_of_run = flatten(_run(mapping, values, source, _Named("", values)).plain_values())
        for number in numbers:
            try:
                values_drawn = scatter_values(settings, number, values_of_run)
            except InputError as error:
                raise error.moved(lambda where: f"{source}: {where}") from None
            named.append((_Named(next(names), {**values, REPEAT: number}, values_drawn), {**values, **values_drawn}))
    return _possible(study, source, named)


def _possible(study: Study, source: Path, named: Sequence[tuple[_Named, Mapping[str, Any]]]) -> Expansion:
    """Return the runs whose values fit together, and the others as refused; raise where none do."""
    runs: list[Run] = []
    refused: list[RefusedRun] = []
    mapping = study_mapping(study)
    for name, changed in named:
        try:
            runs.append(_run(mapping, changed, source, name))
        except InputError as error:
            refused.append(RefusedRun(name.name, name.swept, name.sampled, str(error)))
            if len(refused) == len(named):
                raise
    return Expansion(tuple(runs), tuple(refused))


def _run(mapping: Mapping[str, Any], changed: Mapping[str, Any], source: Path, named: _Named) -> Run:
    study = parse_study(with_values(mapping, changed), source)
    values = ", ".join(f"{path} = {value}" for path, value in named.swept.items())
    where = f"{source} ({values})" if named.swept else str(source)
    return Run(named.name, where, dict(named.swept), study, study.specimen(str(source)), dict(named.sampled))


def _without_empty(value: Any) -> Any:
    """Leave out what was not given, so that the written run reads like a study file."""
    if isinstance(value, Mapping) and PRESET in value and "law" in value:
        # A material that starts from one that ships may differ from it in that something is empty.
        return dict(value)
    if isinstance(value, Mapping):
        return {key: _without_empty(item) for key, item in value.items() if item is not None and item not in ({}, [])}
    return [_without_empty(item) for item in value] if isinstance(value, list) else value
