"""The values of runs for readers: every value with its unit, and where it comes from.

A value of a preset keeps the preset's source; one that differs is the study's. Any other value that equals the default
of the program counts as default.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingerslip.materials.choice import MATERIALS, PRESET, material_of
from fingerslip.parameters import Leaf, walk_values
from fingerslip.parameters.dotted import is_below, known_part
from fingerslip.parameters.presets import Presets, PresetValue
from fingerslip.report.tables.parameters import NOT_USED, ShownValue
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.specimens.protocol import ModelUse, Specimen
from fingerslip.study.definition.runs import Run, read_runs
from fingerslip.study.definition.spec import NOT_OF_A_RUN, Study
from fingerslip.units import Unit

STUDY_FILE, SWEPT, DEFAULT = "study file", "study file, swept", "default"

# Values of a sweep that a cell of a table shows.
_MOST_VALUES = 12

# Keys of a study file that describe the study and no run.
_ABOUT = ("title", *NOT_OF_A_RUN)


@dataclass(frozen=True)
class _Row:
    """A shown value of one run, and its text in the unit of its field, for joining it with the texts of other runs."""

    shown: ShownValue
    text: str


def read_run_values(path: Path) -> Run:
    """Read a run with all its values from its ``run.yaml``."""
    return read_runs(path).runs[0]


def value_rows(runs: Sequence[Run], paths: Collection[str] | None = None) -> tuple[ShownValue, ...]:
    """Return every value of some runs of one study, in the order of the study file."""
    result: dict[str, list[_Row]] = {}
    for run in runs:
        for row in _rows(run, paths):
            result.setdefault(row.shown.path, []).append(row)
    return tuple(_merge_rows(rows, len(runs)) for rows in result.values())


def _merge_rows(rows: Sequence[_Row], runs: int) -> ShownValue:
    """Join the rows of one path over all runs."""
    texts = list(dict.fromkeys(row.text for row in rows))
    first = rows[0].shown
    if len(texts) == 1 and len(rows) == runs:
        return first
    partly = f"in {len(rows)} of {runs} runs" if len(rows) < runs else ""
    notes = dict.fromkeys(text for text in (partly, *(row.shown.note for row in rows)) if text)
    listed = ", ".join(texts) if len(texts) <= _MOST_VALUES else f"{texts[0]}, … ({len(texts)} values)"
    return ShownValue(first.path, listed, SWEPT, "; ".join(notes))


def _rows(run: Run, paths: Collection[str] | None) -> Iterator[_Row]:
    if run.specimen is not None:
        yield from _specimen_rows(run, run.specimen, paths)
    if _is_solid(run.study) and run.study.formulation is None:
        yield _row("formulation", "solid", "derived", "three-dimensional elements")
    named = {f"materials.{name}": entry for name, entry in run.study.materials.items() if isinstance(entry, Mapping)}
    for path, entry in named.items():
        yield _row(f"{path}.{PRESET}", str(entry[PRESET]), STUDY_FILE)
        origin = _origin_of(MATERIALS, str(entry[PRESET]), path)
        yield from (_row_of(path, leaf, origin, paths) for leaf in walk_values(material_of(entry)))
    for leaf in walk_values(run.study):
        is_named = any(is_below(leaf.path, path) for path in named)
        if not is_named and leaf.path.partition(".")[0] not in (*_ABOUT, *SPECIMENS):
            is_given = not leaf.is_default if paths is None else any(is_below(path, leaf.path) for path in paths)
            yield _row(leaf.path, _text(leaf.value, leaf.unit), STUDY_FILE if is_given else DEFAULT)


def _row(path: str, value: str, source: str, note: str = "") -> _Row:
    return _Row(ShownValue(path, value, source, note), value)


def _specimen_rows(run: Run, specimen: Specimen, paths: Collection[str] | None) -> Iterator[_Row]:
    """Yield the values of the specimen: the preset's with their sources, others with the preset's value beside."""
    kind = str(run.study.specimen_kind)
    presets, values = SPECIMENS[kind], getattr(run.study, kind)
    name, origins = str(values["preset"]), {}
    yield _row(f"{kind}.preset", name, STUDY_FILE)
    for layer, material in (values.get("materials") or {}).items():
        if isinstance(material, Mapping) and PRESET in material:
            path, shipped = f"{kind}.materials.{layer}", str(material[PRESET])
            yield _row(f"{path}.{PRESET}", shipped, STUDY_FILE)
            origins[path] = _origin_of(MATERIALS, shipped, path)
    whole = _origin_of(presets, name, kind)
    for leaf in walk_values(specimen):
        if reason := _unused_reason(leaf.path, run.study, specimen):
            yield _row(f"{kind}.{leaf.path}", _text(leaf.value, leaf.unit), NOT_USED, reason)
            continue
        element = next((origin for path, origin in origins.items() if is_below(f"{kind}.{leaf.path}", path)), whole)
        yield _row_of(kind, leaf, element, paths)


@dataclass(frozen=True)
class _Origin:
    """The values of a preset, by their paths in the study: as its file says them, and as they are."""

    entries: Mapping[str, PresetValue]
    values: Mapping[str, Any]


def _origin_of(presets: Presets[Any], name: str, path: str) -> _Origin:
    """Return the values of a preset that stands at a path in a study."""
    return _Origin(
        {f"{path}.{entry.path}": entry for entry in presets.table(name)},
        {f"{path}.{leaf.path}": leaf.value for leaf in walk_values(presets.read(name))},
    )


def _row_of(group: str, leaf: Leaf, origin: _Origin, paths: Collection[str] | None) -> _Row:
    """Return the row of a value in a group that starts from a preset: with its source, or the preset's value beside."""
    path, text = f"{group}.{leaf.path}", _text(leaf.value, leaf.unit)
    source, untouched = known_part(path, origin.entries), paths is None or path not in paths
    entry = origin.entries.get(source)
    is_preset = leaf.value == origin.values.get(path) and untouched
    if is_preset and entry:
        # Of a list the preset has one source for all values in it.
        return _Row(ShownValue(path, entry.value if source == path else text, entry.source, entry.note), text)
    # A law that the preset does not have brings its own defaults.
    brought = leaf.is_default and path not in origin.values and untouched
    return _row(path, text, DEFAULT if is_preset or brought else STUDY_FILE, f"preset: {entry.value}" if entry else "")


def _unused_reason(path: str, study: Study, specimen: Specimen) -> str:
    """Return why a run does not use a value of its specimen; empty for one that it uses."""
    group, _, rest = path.partition(".")
    if group in ("formulation", "depth") and getattr(study, group) is not None:
        return f"the study gives its own {group}"
    if group == "materials" and rest.partition(".")[0] in study.materials:
        return "the study gives its own material"
    use = ModelUse(
        dim=3 if _is_solid(study) else 2,
        meshed=study.mesh.needs_specimen,
        held=not study.supports,
        groups=frozenset(study.record.all_groups),
    )
    return specimen.unused_reason(path, use)


def _is_solid(study: Study) -> bool:
    return study.formulation == "solid" or study.mesh.dim == 3


def _text(value: object, unit: Unit | None) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(_text(item, unit) for item in value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return f"{value:.10g}" if unit is None else unit.format(value)
    return str(value)
