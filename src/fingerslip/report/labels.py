"""What reports say: the texts of ``templates/prose.yaml``, and what paths, swept values and runs are called."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from types import MappingProxyType
from typing import Any

from fingerslip.libraries import xr
from fingerslip.parameters.yaml_text import parse_document
from fingerslip.results import RunResult
from fingerslip.units import split_quantity, without_rounding

# What texts call counterfaces, by their shapes; those of several kinds or of the user's own are counterfaces.
_SHAPES = {"plane": "plate", "cylinder": "cylinder", "sphere": "ball"}
_SHAPE_PATH = re.compile(r"contacts?\.(?:\d+\.)?counterface\.(\w+)")
_NAMES = {"youngs modulus": "Young's modulus", "poisson ratio": "Poisson's ratio"}
# What these groups hold is named with them: a speed is that of the slide.
_NAMED_WITH = ("press", "hold", "slide", "lift")
_LAYERS = "materials"


def with_counterface(text: str, shapes: Iterable[str]) -> str:
    """Return a text that says plate with the word for counterfaces of these shapes.

    Examples
    --------
    >>> with_counterface("work of the plate", ["sphere"]), with_counterface("the plate's way", ["sphere", "plane"])
    ('work of the ball', "the counterface's way")
    """
    words = {_SHAPES.get(shape, "counterface") for shape in shapes} or {"plate"}
    return re.sub(r"\bplate\b", words.pop() if len(words) == 1 else "counterface", text)


def of_histories(text: str, histories: Iterable[xr.Dataset]) -> str:
    """Return a text that says plate with the word for the counterfaces of histories; old ones do not tell it."""
    told = [
        history.coords["counterface_shape"].values for history in histories if "counterface_shape" in history.coords
    ]
    return with_counterface(text, [str(shape) for shapes in told for shape in shapes])


def of_runs(text: str, runs: Iterable[RunResult]) -> str:
    """Return a text that says plate with the word for the counterfaces of runs."""
    found = [_SHAPE_PATH.match(path) for run in runs for path in run.all_values]
    return with_counterface(text, [match[1] for match in found if match])


def path_label(path: str) -> str:
    """Return a dotted path in words, as :func:`path_labels` does where it is alone."""
    return path_labels([path])[path]


def path_labels(paths: Sequence[str]) -> dict[str, str]:
    """Return dotted paths in words, with as many of their last parts as tell them apart, and layers of materials.

    Examples
    --------
    >>> list(path_labels(["a.sagittal.half_height", "a.bone.half_width", "a.skin.half_width"]).values())
    ['half height', 'bone half width', 'skin half width']
    >>> list(path_labels(["programme.1.slide.speed", "fingertip.phalanx.variant"]).values())
    ['slide speed', 'phalanx']
    >>> path_label("fingertip.materials.epidermis.youngs_modulus")
    "epidermis Young's modulus"
    """
    keys = {path: path.split(".") for path in paths}
    count = {path: 2 if set(names[-2:-1]) & set(_NAMED_WITH) else 1 for path, names in keys.items()}
    count |= {path: names[::-1].index(_LAYERS) for path, names in keys.items() if _LAYERS in names[:-1]}
    for _ in range(max(map(len, keys.values()), default=0)):
        labels = {path: _words(path, count[path]) for path in paths}
        twins = [path for path in paths if list(labels.values()).count(labels[path]) > 1]
        count |= {path: count[path] + 1 for path in twins}
    return {path: _words(path, count[path]) for path in paths}


def _words(path: str, count: int) -> str:
    """Return the last parts of a path in words, without one that only says which of several, or whether at all."""
    subject = path.removesuffix(".enabled").removesuffix(".variant")
    words = " ".join(subject.split(".")[-count:]).replace("_", " ")
    for plain, name in _NAMES.items():
        words = words.replace(plain, name)
    return words


def swept_text(value: object) -> str | float | int | bool | None:
    """Return a swept value as tables and axes show it: numbers with twelve digits, lists and mappings as text.

    Examples
    --------
    >>> swept_text(0.1 * 6), swept_text("0.6000000000000001 mm")
    (0.6, '0.6 mm')
    >>> swept_text([1, 0, -1]), swept_text({"sphere": {"radius": "8 mm"}})
    ('1, 0, -1', 'sphere radius 8 mm')
    """
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {swept_text(part)}" for name, part in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(str(swept_text(part)) for part in value)
    if isinstance(value, float):
        return float(without_rounding(repr(value)))
    return value if isinstance(value, int | None) else without_rounding(str(value))


def run_title(result: RunResult, alone: str) -> str:
    """Return the title of a run: its swept values, or what it is called `alone`, where nothing is swept."""

    def text(value: object) -> str:
        if isinstance(value, bool):
            return "yes" if value else "no"
        return f"({swept_text(value)})" if isinstance(value, list | tuple) else str(swept_text(value))

    labels = path_labels(tuple(result.swept))
    return ", ".join(f"{labels[path]} {text(value)}" for path, value in result.swept.items()) or alone or result.name


def first_named(names: Sequence[str], most: int = 3) -> str:
    """Return names as they stand in a sentence: the first few, and how many more."""
    return ", ".join(names[:most]) + f" and {len(names) - most} more" * (len(names) > most)


def number_and_unit(value: object) -> tuple[float, str] | None:
    """Return the number of a swept value and its unit as written, empty for a plain number; None for anything else."""
    if isinstance(value, str):
        return split_quantity(value)
    return (float(value), "") if isinstance(value, int | float) and not isinstance(value, bool) else None


_NOTHING: Mapping[str, object] = MappingProxyType({})


def asset(name: str) -> str:
    """Return a file of the folder of templates."""
    return resources.files("fingerslip.report").joinpath("templates", name).read_text(encoding="utf-8")


@functools.cache
def groups() -> Mapping[str, Mapping[str, Any]]:
    """Return all texts by the group and the name."""
    content: Mapping[str, Mapping[str, Any]] = parse_document(asset("prose.yaml"), "prose.yaml").content
    return content


def prose(group: str, name: str, values: Mapping[str, object] = _NOTHING) -> str:
    """Return a text with the values that stand in it by their names."""
    return str(groups()[group][name]).format_map(values)
