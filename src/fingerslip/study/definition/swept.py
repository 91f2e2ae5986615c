"""What a sweep changes: the combinations of its values, and every mistake in its paths and values.

A key of a sweep is the dotted path of a value, or several with commas between them, whose values change together.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from fingerslip.errors import InputError, Mistakes
from fingerslip.parameters.dotted import assign, is_below, join_path, nearest

__all__ = ["check_sweep", "combinations", "swept_mistakes", "swept_together", "unknown_paths", "with_values"]

_Check = Callable[[Mapping[str, Any]], Sequence[InputError]]


def check_sweep(sweep: Mapping[str, tuple[Any, ...]]) -> Mapping[str, tuple[Any, ...]]:
    """Return a sweep whose lists are right on their own."""
    mistakes = Mistakes()
    for path, values in sweep.items():
        with mistakes.collect():
            _check_values(path, values, sweep)
    mistakes.raise_all()
    return sweep


def _check_values(path: str, values: Sequence[Any], sweep: Mapping[str, Any]) -> None:
    if not values:
        raise InputError(path, "has no values", "needs a list such as [0.2, 0.4]")
    plain = [_without_spaces(value) for value in values]
    repeated = [value for number, value in enumerate(values) if plain[number] in plain[:number]]
    if repeated:
        raise InputError(path, f"has {repeated[0]!r} twice", "needs every value once")
    paths = swept_together(path)
    for number, value in enumerate(values if len(paths) > 1 else ()):
        if not isinstance(value, list | tuple) or len(value) != len(paths):
            fault, needed = f"got {value!r}", f"needs a list of {len(paths)} values, one for each path"
            raise InputError(join_path(path, str(number)), fault, needed)
    others = [other for key in sweep for other in swept_together(key) if key != path or len(paths) > 1]
    for path_of_value in paths:
        inside = next((other for other in others if path_of_value != other and is_below(path_of_value, other)), None)
        if inside is not None or others.count(path_of_value) > (len(paths) > 1):
            repeated_in = inside or path_of_value
            raise InputError(path, f"is a part of the swept '{repeated_in}'", "needs paths apart from each other")


def _without_spaces(value: object) -> object:
    """Return a value that is the same for '1 mm' and '1mm'."""
    return "".join(value.split()) if isinstance(value, str) and value[:1] in "+-.0123456789" else value


def swept_together(key: str) -> tuple[str, ...]:
    """Return the dotted paths that a key of a sweep names.

    Examples
    --------
    >>> swept_together("contact.friction_coefficient, depth")
    ('contact.friction_coefficient', 'depth')
    """
    return tuple(path.strip() for path in key.split(","))


def combinations(sweep: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    """Return all combinations of the swept values, by path; the first path varies slowest.

    Examples
    --------
    >>> combinations({"a": [1, 2], "b": [3]})
    [{'a': 1, 'b': 3}, {'a': 2, 'b': 3}]
    >>> combinations({"a, b": [[1, 3], [2, 4]]})
    [{'a': 1, 'b': 3}, {'a': 2, 'b': 4}]
    """
    rows = itertools.product(*(_rows(key, values) for key, values in sweep.items()))
    return [{path: value for part in row for path, value in part.items()} for row in rows]


def _rows(key: str, values: Sequence[Any]) -> list[dict[str, Any]]:
    """Return the values of each of the paths of a key, one after another."""
    paths = swept_together(key)
    return [dict(zip(paths, value if len(paths) > 1 else (value,), strict=True)) for value in values]


def with_values(mapping: Mapping[str, Any], swept: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of a study as plain data with other values, without a sweep, samples and repeats."""
    run_values = {name: value for name, value in mapping.items() if name not in ("sample", "repeats")}
    changed = copy.deepcopy({**run_values, "sweep": {}})
    for path, value in swept.items():
        assign(changed, path, copy.deepcopy(value))
    return changed


def swept_mistakes(
    study: Mapping[str, Any],
    known_mistakes: Sequence[InputError],
    known_paths: Mapping[str, Sequence[str]],
    mistakes_of: _Check,
) -> list[InputError]:
    """Return the mistakes in the paths and values of a study's sweep, each once.

    A value is wrong where a run that has it is: all combinations are checked, so a value may be right or wrong because
    of the other swept values, and what the sweep replaces does not matter.
    """
    if any(is_below(mistake.where, "sweep") for mistake in known_mistakes):
        return []
    wrong_fields = {mistake.where.partition(".")[0] for mistake in known_mistakes} - known_paths.keys()
    keys = {path: key for key in study["sweep"] for path in swept_together(key)}
    judged = [path for path in keys if path.partition(".")[0] not in wrong_fields]
    unknown = unknown_paths(judged, known_paths, "sweep")
    misnamed = {keys[mistake.where.removeprefix("sweep.")] for mistake in unknown}
    sweep = {
        key: values for key, values in study["sweep"].items() if key not in misnamed and _can_assign(study, key, values)
    }
    unknown = [_in_key(mistake, keys) for mistake in unknown]
    return [*unknown, *_mistakes_of_runs(study, sweep, known_mistakes, mistakes_of)]


def _mistakes_of_runs(
    study: Mapping[str, Any],
    sweep: Mapping[str, Sequence[Any]],
    known_mistakes: Sequence[InputError],
    mistakes_of: _Check,
) -> Iterable[InputError]:
    """Return the mistakes that runs have and the study has not."""
    contents = {_content(mistake) for mistake in known_mistakes}
    mistakes: dict[tuple[str, ...], InputError] = {}
    for swept in combinations(sweep):
        for mistake in mistakes_of(with_values(study, swept)):
            if _content(mistake) not in contents:
                placed = _place_mistake(mistake, swept, sweep)
                mistakes.setdefault((placed.where, *_content(mistake)), placed)
    return mistakes.values()


def unknown_paths(paths: Sequence[str], known_paths: Mapping[str, Sequence[str]], group: str) -> list[InputError]:
    """Return a mistake for each of `paths`, which stand in `group` of a study, that leads to no value of the study."""
    paths_known = [path for paths_of_field in known_paths.values() for path in paths_of_field]
    return [_unknown(path, paths_known, group) for path in paths if path not in paths_known]


def _unknown(path: str, paths: Sequence[str], group: str) -> InputError:
    parent = path.rpartition(".")[0]
    beside = sorted({other.rpartition(".")[2] for other in paths if parent and other.rpartition(".")[0] == parent})
    near = nearest(path, paths)
    # A name that is like none of its group is better answered by the names of the group.
    if near in {None, parent} and beside:
        return InputError(f"{group}.{path}", "is not known", f"{parent} may have {', '.join(beside)}")
    repair = f"did you mean '{near}'?" if near else "fingerslip show STUDY lists all paths"
    return InputError(f"{group}.{path}", "is not known", "needs the dotted path of a value of the study", repair)


def _in_key(mistake: InputError, keys: Mapping[str, str]) -> InputError:
    """Return the mistake of a path at the key of the sweep that it stands in."""
    path = mistake.where.removeprefix("sweep.")
    if keys[path] == path:
        return mistake
    return InputError(f"sweep.{keys[path]}", f"has '{path}', which is not known", mistake.allowed, mistake.repair)


def _can_assign(study: Mapping[str, Any], key: str, values: Sequence[Any]) -> bool:
    """Tell whether paths lead somewhere; they may not where a field is wrong itself."""
    try:
        with_values(study, _rows(key, values)[0])
    except LookupError:
        return False
    return True


def _place_mistake(mistake: InputError, swept: Mapping[str, Any], sweep: Mapping[str, Sequence[Any]]) -> InputError:
    """Return a mistake of a run at the swept value that it is in; where it is in none, with the values of the run."""
    path = next((path for path in swept if is_below(mistake.where, path)), None)
    if path is None:
        run = ", ".join(f"{path} = {value}" for path, value in swept.items())
        return InputError(mistake.where, f"{mistake.found} in the run with {run}", mistake.allowed, mistake.repair)
    misnamed = mistake.where == path and mistake.found == "is not known"
    key = next(key for key in sweep if path in swept_together(key))
    rows = _rows(key, sweep[key])
    number = next(number for number, row in enumerate(rows) if row.items() <= swept.items())
    column = (str(swept_together(key).index(path)),) if len(rows[0]) > 1 else ()
    item = () if misnamed else (str(number), *column)
    return mistake.moved(lambda where: join_path("sweep", key, *item, where[len(path) + 1 :]))


def _content(mistake: InputError) -> tuple[str, str, str]:
    return mistake.where, mistake.found, mistake.allowed
