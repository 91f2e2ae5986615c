"""What a sweep changes: the combinations of its values, and every mistake in its paths and values.

A key of a sweep is the dotted path of a value, or several with commas between them, whose values change together.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

from fingerslip.errors import InputError, Mistakes
from fingerslip.parameters.dotted import assign, is_below, join_path, nearest

#: Returns the mistakes of a study in which some values, by dotted path, are others.
Check: TypeAlias = Callable[[Mapping[str, Any]], Sequence[InputError]]


def check_sweep(sweep: Mapping[str, tuple[Any, ...]]) -> Mapping[str, tuple[Any, ...]]:
    """Return a sweep whose lists are right on their own."""
    mistakes = Mistakes()
    for key, values in sweep.items():
        with mistakes.collect():
            _check_values(key, values, sweep)
    mistakes.raise_all()
    return sweep


def _check_values(key: str, values: Sequence[Any], sweep: Mapping[str, Any]) -> None:
    if not values:
        raise InputError(key, "has no values", "needs a list such as [0.2, 0.4]")
    plain = [_without_spaces(value) for value in values]
    repeated = [value for number, value in enumerate(values) if plain[number] in plain[:number]]
    if repeated:
        raise InputError(key, f"has {repeated[0]!r} twice", "needs every value once")
    paths = swept_together(key)
    for number, value in enumerate(values if len(paths) > 1 else ()):
        if not isinstance(value, list | tuple) or len(value) != len(paths):
            fault, needed = f"got {value!r}", f"needs a list of {len(paths)} values, one for each path"
            raise InputError(join_path(key, str(number)), fault, needed)
    others = [path for other in sweep for path in swept_together(other) if other != key or len(paths) > 1]
    for path in paths:
        outer = next((other for other in others if path != other and is_below(path, other)), None)
        if outer is not None or others.count(path) > (len(paths) > 1):
            raise InputError(key, f"is a part of the swept '{outer or path}'", "needs paths apart from each other")


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


def with_values(plain: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of a study as plain data with other values, without a sweep, samples and repeats."""
    changed = {name: value for name, value in plain.items() if name not in ("sample", "repeats")} | {"sweep": {}}
    changed = copy.deepcopy(changed)
    for path, value in changes.items():
        assign(changed, path, copy.deepcopy(value))
    return changed


def swept_mistakes(
    plain: Mapping[str, Any], mistakes: Sequence[InputError], paths: Mapping[str, Sequence[str]], check: Check
) -> list[InputError]:
    """Return the mistakes in the paths and values of the sweep of a study as plain data, each once.

    `mistakes` are its others, `paths` those of its values by their field; `check` returns mistakes with other values.
    A value is wrong where a run that has it is: all combinations are checked, so a value may be right or wrong because
    of the other swept values, and what the sweep replaces does not matter.
    """
    if any(is_below(mistake.where, "sweep") for mistake in mistakes):
        return []
    wrong_fields = {mistake.where.partition(".")[0] for mistake in mistakes} - paths.keys()
    keys = {path: key for key in plain["sweep"] for path in swept_together(key)}
    unknown = unknown_paths([path for path in keys if path.partition(".")[0] not in wrong_fields], paths, "sweep")
    misnamed = {keys[mistake.where.removeprefix("sweep.")] for mistake in unknown}
    sweep = {
        key: values for key, values in plain["sweep"].items() if key not in misnamed and _leads_to(plain, key, values)
    }
    contents = {_content(mistake) for mistake in mistakes}
    of_runs: dict[tuple[str, ...], InputError] = {}
    for swept in combinations(sweep):
        for mistake in check(swept):
            if _content(mistake) not in contents:
                in_sweep = _place_mistake(mistake, swept, sweep)
                of_runs.setdefault((in_sweep.where, *_content(mistake)), in_sweep)
    return [*(_in_key(mistake, keys) for mistake in unknown), *of_runs.values()]


def _content(mistake: InputError) -> tuple[str, str, str]:
    return mistake.where, mistake.found, mistake.allowed


def unknown_paths(paths: Sequence[str], available: Mapping[str, Sequence[str]], group: str) -> list[InputError]:
    """Return a mistake for each of `paths`, which stand in `group` of a study, that leads to no value of the study."""
    names = [name for names_of_field in available.values() for name in names_of_field]
    return [_unknown(path, names, group) for path in paths if path not in names]


def _unknown(path: str, names: Sequence[str], group: str) -> InputError:
    parent = path.rpartition(".")[0]
    beside = sorted({name.rpartition(".")[2] for name in names if parent and name.rpartition(".")[0] == parent})
    near = nearest(path, names)
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


def _leads_to(plain: Mapping[str, Any], key: str, values: Sequence[Any]) -> bool:
    """Tell whether paths lead somewhere; they may not where a field is wrong itself."""
    try:
        with_values(plain, _rows(key, values)[0])
    except LookupError:
        return False
    return True


def _place_mistake(mistake: InputError, swept: Mapping[str, Any], sweep: Mapping[str, Sequence[Any]]) -> InputError:
    """Return a mistake of a run at the swept value that it is in; where it is in none, with the values of the run."""
    path = next((path for path in swept if is_below(mistake.where, path)), None)
    if path is None:
        run = ", ".join(f"{path} = {value}" for path, value in swept.items())
        return InputError(mistake.where, f"{mistake.found} in the run with {run}", mistake.allowed, mistake.repair)
    key = next(key for key in sweep if path in swept_together(key))
    if mistake.where == path and mistake.found == "is not known":
        return mistake.moved(lambda _: join_path("sweep", key))
    rows = _rows(key, sweep[key])
    number = next(number for number, row in enumerate(rows) if row.items() <= swept.items())
    column = (str(swept_together(key).index(path)),) if len(rows[0]) > 1 else ()
    return mistake.moved(lambda where: join_path("sweep", key, str(number), *column, where[len(path) + 1 :]))
