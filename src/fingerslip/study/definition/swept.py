"""What a sweep changes: the combinations of its values, and every mistake in its paths and values."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from fingerslip.errors import InputError, Mistakes
from fingerslip.parameters.dotted import assign, is_below, joined, nearest

__all__ = ["check_sweep", "combinations", "swept_mistakes", "unknown_paths", "with_values"]

_Check = Callable[[Mapping[str, Any]], Sequence[InputError]]


def check_sweep(sweep: Mapping[str, tuple[Any, ...]]) -> Mapping[str, tuple[Any, ...]]:
    """Return a sweep whose lists are right on their own.

    Parameters
    ----------
    sweep : mapping of str to tuple
        Values by dotted path.

    Raises
    ------
    InputError
        For every empty list, every value that stands twice in its list, and every path inside another one.
    """
    mistakes = Mistakes()
    for path, values in sweep.items():
        with mistakes.collected():
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
    inside = next((other for other in sweep if path != other and is_below(path, other)), None)
    if inside is not None:
        raise InputError(path, f"is a part of the swept '{inside}'", "needs paths apart from each other")


def _without_spaces(value: object) -> object:
    """Return a value that is the same for '1 mm' and '1mm'."""
    return "".join(value.split()) if isinstance(value, str) and value[:1] in "+-.0123456789" else value


def combinations(sweep: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    """Return all combinations of the swept values, by path; the first path varies slowest.

    Examples
    --------
    >>> combinations({"a": [1, 2], "b": [3]})
    [{'a': 1, 'b': 3}, {'a': 2, 'b': 3}]
    """
    return [dict(zip(sweep, values, strict=True)) for values in itertools.product(*sweep.values())]


def with_values(mapping: Mapping[str, Any], swept: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of a study as plain data with other values, without a sweep and without samples.

    Parameters
    ----------
    mapping : mapping
        What a study file holds.
    swept : mapping of str to object
        Values by dotted path.

    Raises
    ------
    LookupError
        Where a path leads through a scalar, or to an item that a list does not have.
    """
    kept = {name: value for name, value in mapping.items() if name != "sample"}
    changed = copy.deepcopy({**kept, "sweep": {}})
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

    Parameters
    ----------
    study : mapping
        What a study file holds, right or wrong.
    known_mistakes : sequence of InputError
        The mistakes of the study without its sweep.
    known_paths : mapping of str to sequence of str
        The paths that may be swept, by the field of the study that they begin with; of a field that is wrong itself
        none are known, and paths into it are not judged.
    mistakes_of : callable
        Returns the mistakes of a study as plain data, with dotted paths as locations.
    """
    if any(is_below(mistake.where, "sweep") for mistake in known_mistakes):
        return []
    wrong_fields = {mistake.where.partition(".")[0] for mistake in known_mistakes} - known_paths.keys()
    judged = [path for path in study["sweep"] if path.partition(".")[0] not in wrong_fields]
    unknown = unknown_paths(judged, known_paths, "sweep")
    misnamed = {mistake.where.removeprefix("sweep.") for mistake in unknown}
    sweep = {
        path: values
        for path, values in study["sweep"].items()
        if path not in misnamed and _can_be_assigned(study, path, values)
    }
    return [*unknown, *_mistakes_of_runs(study, sweep, known_mistakes, mistakes_of)]


def _mistakes_of_runs(
    study: Mapping[str, Any],
    sweep: Mapping[str, Sequence[Any]],
    known_mistakes: Sequence[InputError],
    mistakes_of: _Check,
) -> Iterable[InputError]:
    """Return the mistakes that runs have and the study has not."""
    known = {_content(mistake) for mistake in known_mistakes}
    found: dict[tuple[str, ...], InputError] = {}
    for swept in combinations(sweep):
        for mistake in mistakes_of(with_values(study, swept)):
            if _content(mistake) not in known:
                placed = _placed(mistake, swept, sweep)
                found.setdefault((placed.where, *_content(mistake)), placed)
    return found.values()


def unknown_paths(paths: Sequence[str], known_paths: Mapping[str, Sequence[str]], group: str) -> list[InputError]:
    """Return a mistake for each of `paths`, which stand in `group` of a study, that leads to no value of the study."""
    known = [path for own in known_paths.values() for path in own]
    return [_unknown(path, nearest(path, known), group) for path in paths if path not in known]


def _unknown(path: str, near: str | None, group: str) -> InputError:
    repair = f"did you mean '{near}'?" if near else "fingerslip show STUDY lists all paths"
    return InputError(f"{group}.{path}", "is not known", "needs the dotted path of a value of the study", repair)


def _can_be_assigned(study: Mapping[str, Any], path: str, values: Sequence[Any]) -> bool:
    """Tell whether a path leads somewhere; it may not where a field is wrong itself."""
    try:
        with_values(study, {path: values[0]})
    except LookupError:
        return False
    return True


def _placed(mistake: InputError, swept: Mapping[str, Any], sweep: Mapping[str, Sequence[Any]]) -> InputError:
    """Return a mistake of a run at the swept value that it is in; where it is in none, with the values of the run."""
    path = next((path for path in swept if is_below(mistake.where, path)), None)
    if path is None:
        run = ", ".join(f"{path} = {value}" for path, value in swept.items())
        return InputError(mistake.where, f"{mistake.found} in the run with {run}", mistake.allowed, mistake.repair)
    misnamed = mistake.where == path and mistake.found == "is not known"
    item = "" if misnamed else str(sweep[path].index(swept[path]))
    return mistake.moved(lambda where: joined("sweep", path, item, where[len(path) + 1 :]))


def _content(mistake: InputError) -> tuple[str, str, str]:
    return mistake.where, mistake.found, mistake.allowed
