"""The runs of a study, each with all its values and a name for its folder, and which of them are finished.

Names of runs are short, safe on every file system, and different. Nothing here loads what builds, computes or draws
runs: a study that is finished needs none of it.
"""

from __future__ import annotations

import dataclasses
import os
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from fingerslip.contact.counterfaces import sliding_direction
from fingerslip.errors import InputError, Mistakes, errors_at
from fingerslip.materials.choice import PRESET, material_of
from fingerslip.mesh.source import MeshFile, content_hash, other_files
from fingerslip.model.programme import Phase, Slide
from fingerslip.parameters import as_mapping
from fingerslip.parameters.dotted import flatten
from fingerslip.results import REPEAT, SAMPLE, RefusedRun, RunResult, read_result
from fingerslip.slip.events import Events
from fingerslip.specimens.protocol import Specimen
from fingerslip.storage.files import digest
from fingerslip.study.definition.expressions import derive
from fingerslip.study.definition.file import study_file
from fingerslip.study.definition.settings import ContactSettings
from fingerslip.study.definition.spec import NOT_OF_A_RUN, PlainStudy, Study
from fingerslip.study.definition.sweep import changed_paths, combinations, drawn, scatter_values
from fingerslip.units import without_rounding
from fingerslip.version import __version__

#: Raised whenever the numerics or the files of a run change, so that older runs are computed again.
RESULT_FORMAT = 10

T = TypeVar("T")

_EMPTY: Mapping[str, Any] = MappingProxyType({})
_LONGEST = 100
_LARGEST_COPY = 20_000_000  # mesh file that is copied [bytes]
_UNSAFE = re.compile(r"[^A-Za-z0-9.+-]+")
_UNSAFE_IN_LABELS = re.compile(r"[^A-Za-z0-9_+-]+")


@dataclass(frozen=True)
class Run:
    """One run of a study."""

    name: str  # name of its folder, from the swept values and the number of the sample
    where: str  # its name in errors: the study file, the swept values and the number of the sample
    swept: Mapping[str, Any]  # the swept values by dotted path, as the study file writes them
    study: Study  # the study with these values, without a sweep and without samples
    specimen: Specimen | None  # the specimen with all its values
    sampled: Mapping[str, Any] = field(default_factory=lambda: _EMPTY)

    @cached_property
    def mesh_key(self) -> str:
        """What decides its mesh, hashed: runs with the same key share one mesh."""
        with errors_at(self.where):
            return self.study.mesh.key(self.specimen)

    @cached_property
    def identity(self) -> str:
        """Hash of everything that decides its result: its values, its mesh files, the program."""
        # A slide that says its default direction gives the same result as one that does not.
        plain_values = dataclasses.replace(self, study=with_directions(self.study, default=False)).plain_values
        values = {key: value for key, value in plain_values.items() if key != "title"}
        values["mesh"] = {"hash": self.mesh_key}
        return digest([{"format": RESULT_FORMAT, "version": __version__}, values])

    @cached_property
    def written_values(self) -> Mapping[str, Any]:
        """What is written of it: its plain values, the directions that slides have by default, and its mesh's copy."""
        values = dict(dataclasses.replace(self, study=with_directions(self.study)).plain_values)
        return values | {"mesh": values["mesh"] | {"file": f"../{self.mesh_copy}"}} if self.mesh_copy else values

    @property
    def mesh_copy(self) -> str:
        """Name of the copy of its mesh file in the results of its study; empty where there is none."""
        return next(iter(self.mesh_files), "")

    @cached_property
    def mesh_files(self) -> Mapping[str, Path]:
        """Its mesh file and those that this reads, by the names of their copies, with a hash of what is in them.

        There are none without a mesh file, of what is large, and of files that are not beside the first or below it.
        """
        if not isinstance(self.study.mesh, MeshFile):
            return {}
        file = Path(self.study.mesh.file)
        others = {os.path.relpath(other, file.parent): other for other in other_files(file)}
        size = sum(path.stat().st_size for path in (file, *others.values()))
        if size > _LARGEST_COPY or any(name.startswith("..") for name in others):
            return {}
        mark = content_hash("mesh.file", str(file), "needs a mesh file")[:8]
        stem = f"{file.stem.removesuffix(f'-{mark}')}-{mark}"
        names = {f"{stem}{file.suffix}": file, **others}
        return {f"{stem}/{name}": path for name, path in names.items()} if others else names

    @cached_property
    def plain_values(self) -> Mapping[str, Any]:
        """Everything that makes the run as plain data, which is a study file of its own."""
        mapping: dict[str, Any] = as_mapping(self.study)
        kind = self.study.specimen_kind
        if kind is not None:
            written, values = mapping[kind], as_mapping(self.specimen)
            for name, element in (written.get("materials") or {}).items():
                # A material that starts from one that ships keeps its name.
                if PRESET in element:
                    values["materials"][name] = {PRESET: element[PRESET], **values["materials"][name]}
            mapping[kind] = {"preset": written["preset"], **values}
        for name, entry in self.study.materials.items():
            if isinstance(entry, Mapping):
                mapping["materials"][name] = {PRESET: entry[PRESET], **as_mapping(material_of(entry))}
        named = f"{mapping['title']}: {self.name}" if self.swept else mapping["title"]
        run_values = {key: value for key, value in mapping.items() if key not in ("title", *NOT_OF_A_RUN)}
        result: dict[str, Any] = _without_empty({"title": named, **run_values})
        return result


def _without_empty(value: Any) -> Any:
    """Leave out what was not given, so that the written run reads like a study file."""
    if isinstance(value, Mapping) and PRESET in value and "law" in value:
        # A material that starts from one that ships may differ from it in that something is empty.
        return dict(value)
    if isinstance(value, Mapping):
        return {key: _without_empty(item) for key, item in value.items() if item is not None and item not in ({}, [])}
    return [_without_empty(item) for item in value] if isinstance(value, list) else value


def with_directions(study: Study, *, default: bool = True) -> Study:
    """Return a study whose slides say in which direction counterfaces go, unless they go in several.

    Without `default` none says the direction that it has by default.
    """
    dim = 3 if study.is_solid or not (study.formulation or study.specimen_kind) else 2
    followers = [contact for contact in study.all_contacts if contact.programme is None and not contact.rigid_body]

    def directed(contact: ContactSettings) -> ContactSettings:
        programme = contact.programme and _directed(contact.programme, [contact], dim, default)
        return dataclasses.replace(contact, programme=programme)

    return dataclasses.replace(
        study,
        contact=study.contact and directed(study.contact),
        contacts=tuple(map(directed, study.contacts)),
        programme=_directed(study.programme, followers, dim, default),
    )


def _directed(
    programme: Sequence[Phase], contacts: Sequence[ContactSettings], dim: int, said: bool
) -> tuple[Phase, ...]:
    """Return a programme whose slides have the default direction of all its contacts, if it is one, or leave it out."""
    normals = (contact.contact(dim).counterface.unit_normal for contact in contacts)
    directions = {tuple(map(float, sliding_direction(normal) + 0.0)) for normal in normals}
    if len(directions) != 1:
        return tuple(programme)
    direction = directions.pop()
    return tuple(
        dataclasses.replace(phase, direction=direction if said else None)
        if isinstance(phase, Slide) and phase.direction in (None, direction)
        else phase
        for phase in programme
    )


@dataclass(frozen=True)
class Plan:
    """A study, and what running it would do."""

    source: Path  # the study file
    study: Study  # what it holds
    runs: tuple[Run, ...]  # all runs, checked
    folder: Path = Path()  # where the results go
    given: tuple[str, ...] = ()  # dotted paths of the values that the file gives
    refused: tuple[RefusedRun, ...] = ()  # samples whose values do not fit together, which make no run

    @cached_property
    def identities(self) -> dict[str, str]:
        """Hash of the inputs of every run, by its name."""
        return {run.name: run.identity for run in self.runs}

    def finished_runs(self, whole: Collection[str] = ()) -> dict[str, RunResult]:
        """Return the results of the runs that are finished with these inputs, by their names."""
        stored = {run.name: read_result(self.folder / run.name, is_whole=run.name in whole) for run in self.runs}
        return {name: result for name, result in stored.items() if result and result.identity == self.identities[name]}


def read_runs(path: str | Path) -> Plan:
    """Read a study file with its runs; errors as of :func:`~fingerslip.study.definition.spec.read_study`."""
    with study_file(Path(path)) as mapping:
        return expand_mapping(mapping, Path(path))


def plan_study(path: str | Path, results_dir: str | Path = "results") -> Plan:
    """Read a study file as :func:`read_runs`, and check all that can be before anything runs."""
    source = Path(path)
    with study_file(source) as mapping:
        return plan_mapping(mapping, source, Path(results_dir) / source.stem)


def plan_studies(paths: Sequence[str | Path], results_dir: str | Path = "results") -> tuple[Plan, ...]:
    """Read several studies and plan their runs."""
    plans, mistakes = plan_each(paths, results_dir)
    mistakes.raise_all()
    return plans


def plan_each(paths: Sequence[str | Path], results_dir: str | Path = "results") -> tuple[tuple[Plan, ...], Mistakes]:
    """Return the plans of studies without mistakes, and the mistakes of the others; raised where all have some."""
    mistakes, plans = Mistakes(), dict[Path, Plan]()
    for path in paths:
        with mistakes.collect():
            plan = plan_study(path, results_dir)
            twin = plans.setdefault(plan.folder, plan)
            if twin is not plan:
                raise InputError(str(plan.source), f"has the file name of {twin.source}", "needs a name of its own")
    if not plans:
        mistakes.raise_all()
    return tuple(plans.values()), mistakes


def plan_mapping(mapping: Mapping[str, Any], source: Path, folder: Path) -> Plan:
    """Return the plan of a study from plain data; refuse derived quantities of unknown names or unfit units."""
    plan = expand_mapping(mapping, source, folder)
    mistakes, derived = Mistakes(), plan.study.derived
    # A swept group may give runs other values than the first one has.
    examples = [
        RunResult(run.name, run.swept, Events(), values=flatten(run.plain_values)) for run in plan.runs if derived
    ]
    for name, text in derived.items():
        with mistakes.collect():
            units = {derive(name, text, example).unit: example.name for example in examples}
            if len(units) > 1:
                in_runs = ", ".join(f"'{unit}' in {run}" for unit, run in units.items())
                raise InputError(f"derived.{name}", f"has the units {in_runs}", "needs one unit in all runs")
    with errors_at(str(source)):
        mistakes.raise_all()
    for run in plan.runs:  # a mesh file that cannot be read is told now
        without_swept(plan, run, lambda other: other.identity)
    return plan


def without_swept(plan: Plan, run: Run, read: Callable[[Run], T]) -> T:
    """Read a run; its mistakes name no swept values where the last run that has none of them has the same mistakes."""
    try:
        return read(run)
    except InputError as error:
        swept, source, others = run.swept.items(), str(plan.source), Mistakes()
        without = [other for other in plan.runs if all(other.swept.get(path) != value for path, value in swept)]
        last = [run, *without][-1]
        if last is not run and not run.sampled:
            with others.collect():
                read(last)
        alone = str(error).replace(run.where, source)
        same = alone == "\n".join(map(str, others.found)).replace(last.where, source)
        raise error.moved(lambda where: where.replace(run.where, source, 1) if same else where) from None


def expand_mapping(mapping: Mapping[str, Any], source: Path, folder: Path = Path()) -> Plan:
    """Return a study from plain data with its runs; samples whose values do not fit together are refused, unless all.

    The first swept path varies slowest, samples vary fastest.
    """
    plain = PlainStudy(mapping, source)
    study = plain.study
    key, total = (REPEAT, study.repeats.count) if study.repeats else (SAMPLE, study.sample.total if study.sample else 0)
    draws = [(swept, *draw) for swept in combinations(study.sweep) for draw in _draws(plain, swept)]
    numbered = [{**swept, key: f"{number:0{len(str(total))}}"} if total else swept for swept, number, *_ in draws]
    runs: list[Run] = []
    refused: list[RefusedRun] = []
    for name, (swept, number, drawn_values, changes) in zip(run_names(numbered), draws, strict=True):
        swept_and_number = {**swept, key: number} if total else swept
        try:
            runs.append(_run(plain, changes, name, swept_and_number, drawn_values))
        except InputError as error:
            refused.append(RefusedRun(name, swept_and_number, drawn_values, str(error)))
            if len(refused) == len(draws) or not total:
                raise
    if study.reaction is not None:
        runs = _tried_at_centre(runs, _run(plain, {}))
    written = flatten({key: value for key, value in mapping.items() if key not in ("sweep", "sample")})
    paths = (*map(str, written), *changed_paths(mapping))
    return Plan(source, study, tuple(runs), folder, paths, tuple(refused))


def _tried_at_centre(runs: list[Run], centre: Run) -> list[Run]:
    """Return runs of which only that with the study's own values tries reactions; others search critical latencies."""
    values = {**centre.plain_values, "title": ""}
    are_centre = [{**run.plain_values, "title": ""} == values for run in runs]
    for number, is_centre in enumerate(are_centre if any(are_centre) else ()):
        study, reaction = runs[number].study, runs[number].study.reaction
        if not is_centre and reaction:
            study = dataclasses.replace(study, reaction=reaction.without_trials())
            runs[number] = dataclasses.replace(runs[number], study=study)
    return runs


def _draws(plain: PlainStudy, swept: dict[str, Any]) -> Iterator[tuple[int, dict[str, Any], dict[str, Any]]]:
    """Yield the number of each sample or repeat of swept values, what is drawn, and all values that it changes."""
    study = plain.study
    if study.repeats is not None:
        values = flatten(_run(plain, swept).plain_values)
        for number in range(1, study.repeats.count + 1):
            with errors_at(str(plain.source)):
                scattered = scatter_values(study.repeats, number, values)
            yield number, scattered, {**swept, **scattered}
    elif study.sample is not None:
        for number, sampled in enumerate(drawn(study.sample), start=1):
            yield number, sampled, {**swept, **study.sample.values(sampled)}
    else:
        yield 0, {}, swept


def _run(
    plain: PlainStudy,
    changes: Mapping[str, Any],
    name: str = "",
    swept: Mapping[str, Any] = _EMPTY,
    sampled: Mapping[str, Any] = _EMPTY,
) -> Run:
    study = plain.with_values(changes)
    words = ", ".join(f"{path} = {value}" for path, value in swept.items())
    where = f"{plain.source} ({words})" if swept else str(plain.source)
    return Run(name, where, dict(swept), study, study.specimen(str(plain.source)), dict(sampled))


def run_names(combinations: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a name for each run of a sweep, from the values that it has.

    Names keep signs, and twelve digits, or all where that does not tell runs apart. Where two values still look alike
    once what no folder may be called is taken out, as ``a b`` and ``a-b``, or differ only in case, a hash of the values
    does.
    """
    exact = [_name(swept, str) for swept in combinations]
    names = _apart([_name(swept, without_rounding) for swept in combinations], exact)
    hashed = [f"{name}-{digest(dict(swept))[:8]}" for name, swept in zip(names, combinations, strict=True)]
    return _apart(names, hashed)


def _apart(names: Sequence[str], longer: Sequence[str]) -> list[str]:
    """Return names, and longer ones in the place of those that several runs have."""
    alike = Counter(name.lower() for name in names)
    return [name if alike[name.lower()] == 1 else other for name, other in zip(names, longer, strict=True)]


def _name(swept: Mapping[str, Any], digits: Callable[[str], str]) -> str:
    """Return values with the shortest endings of their paths that tell them apart; 'x.enabled' is called 'x'."""
    keys_of_path = {path: path.removesuffix(".enabled").split(".") for path in swept}
    last = Counter(keys[-1] for keys in keys_of_path.values())
    labels = {path: keys[-1] if last[keys[-1]] == 1 else "-".join(keys) for path, keys in keys_of_path.items()}
    words = (f"{_UNSAFE_IN_LABELS.sub('-', labels[path])}-{_slug(value, digits)}" for path, value in swept.items())
    name = "_".join(words) or "run"
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 9]}-{digest(name.encode())[:8]}"


def _slug(value: object, digits: Callable[[str], str]) -> str:
    """Return a value as part of a name; `digits` rounds the numbers of a text, or leaves them."""
    if isinstance(value, Mapping):
        return "-".join(f"{_UNSAFE.sub('-', str(key))}-{_slug(item, digits)}" for key, item in value.items()) or "none"
    if isinstance(value, list | tuple):
        return "_".join(_slug(item, digits) for item in value) or "none"
    if isinstance(value, float):
        value = float(digits(repr(value)))
        short = f"{value:g}"
        return short if float(short) == value else repr(value)
    text = str(value).lower() if isinstance(value, bool) else digits(str(value))
    compact = re.sub(r"(?<=\d)\s+(?=[A-Za-z])", "", text).replace("/", "-per-").replace("µ", "u")
    return _UNSAFE.sub("-", compact).rstrip("-.") or "value"
