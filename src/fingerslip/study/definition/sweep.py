"""What changes from run to run: the values of a sweep, samples, repeats, and every mistake in them."""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, TypeAlias

import numpy as np
import pydantic

from fingerslip.errors import InputError, Mistakes, shorten
from fingerslip.parameters import parameters
from fingerslip.parameters.dotted import assign, guesses, is_below, join_path, nearest
from fingerslip.results import SAMPLE
from fingerslip.sampling.designs import LEVELS, Method, block_size, draw_shares
from fingerslip.units import quantity_of, split_quantity

#: Returns the mistakes of a study in which some values, by dotted path, are others.
Check: TypeAlias = Callable[[Mapping[str, Any]], Sequence[InputError]]


def check_sweep(sweep: Mapping[str, tuple[Any, ...]]) -> Mapping[str, tuple[Any, ...]]:
    """Return a sweep whose lists are right on their own."""
    mistakes, together = Mistakes(), {key: swept_together(key) for key in sweep}
    every = [path for paths in together.values() for path in paths]
    for key, values in sweep.items():
        paths = together[key]
        with mistakes.collect():
            if not values:
                raise InputError(key, "has no values", "needs a list such as [0.2, 0.4]")
            _check_different(key, values)
            for number, value in enumerate(values if len(paths) > 1 else ()):
                if not isinstance(value, list | tuple) or len(value) != len(paths):
                    fault, needed = f"got {value!r}", f"needs a list of {len(paths)} values, one for each path"
                    raise InputError(join_path(key, str(number)), fault, needed)
            for path in paths:
                outer = next((other for other in every if path != other and is_below(path, other)), path)
                if outer != path or every.count(path) > 1:
                    fault = f"is a part of the swept '{outer}'"
                    raise InputError(key, fault, "needs paths apart from each other")
    mistakes.raise_all()
    return sweep


def _check_different(path: str, values: Sequence[Any]) -> None:
    """Refuse a value that is there twice, as '1 mm' and '1mm' are."""
    plain: list[Any] = []
    for value in values:
        is_number = isinstance(value, str) and value[:1] in "+-.0123456789"
        plain.append("".join(value.split()) if is_number else value)
        if plain[-1] in plain[:-1]:
            raise InputError(path, f"has {shorten(repr(value))} twice", "needs every value once")


def swept_together(key: str) -> tuple[str, ...]:
    """Return the dotted paths that a key of a sweep names."""
    return tuple(path.strip() for path in key.split(","))


def changed_paths(mapping: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the dotted paths of the values that the sweep and the samples of a study as plain data change."""
    sample = mapping.get(SAMPLE)
    sampled = [sample.get(group) for group in ("ranges", "choices", "equal")] if isinstance(sample, Mapping) else []
    groups = [group for group in (mapping.get("sweep"), *sampled) if isinstance(group, Mapping)]
    return tuple(path for group in groups for key in group for path in swept_together(str(key)))


def combinations(sweep: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    """Return all combinations of the swept values, by path; the first path varies slowest."""
    rows = itertools.product(*(_rows(key, values) for key, values in sweep.items()))
    return [{path: value for part in row for path, value in part.items()} for row in rows]


def _rows(key: str, values: Sequence[Any]) -> list[dict[str, Any]]:
    """Return the values of each of the paths of a key, one after another."""
    paths = swept_together(key)
    return [dict(zip(paths, value if len(paths) > 1 else (value,), strict=True)) for value in values]


def with_values(plain: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of a study as plain data with other values, without a sweep, samples, a fit and repeats."""
    changed = {name: value for name, value in plain.items() if name not in ("sample", "fit", "repeats")} | {"sweep": {}}
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
    keys = {path: key for key in plain["sweep"] for path in swept_together(key)}
    fields = {path: path.partition(".")[0] for path in keys}
    # Of a field that is wrong, or whose name is misspelt, nothing is known.
    wrong_fields = {mistake.where.partition(".")[0] for mistake in mistakes} - paths.keys()
    unsure = wrong_fields | {nearest(name, list(fields.values())) for name in wrong_fields}
    keys_of_right_fields = {path: key for path, key in keys.items() if fields[path] not in unsure}
    unknown = unknown_paths(keys_of_right_fields, paths, "sweep")
    misnamed = {mistake.where.removeprefix("sweep.") for mistake in unknown}
    sweep = {
        key: values for key, values in plain["sweep"].items() if key not in misnamed and _leads_to(plain, key, values)
    }
    contents = {mistake.args[:3] for mistake in mistakes}
    of_runs: dict[tuple[str, ...], InputError] = {}
    for swept in combinations(sweep):
        for mistake in check(swept):
            if mistake.args[:3] not in contents:
                in_sweep = _place_mistake(mistake, swept, sweep)
                of_runs.setdefault((in_sweep.where, *mistake.args[:3]), in_sweep)
    return [*unknown, *of_runs.values()]


def unknown_paths(keys: Mapping[str, str], available: Mapping[str, Sequence[str]], group: str) -> list[InputError]:
    """Return a mistake for each path that leads to no value of the study; `keys` of a group of it have the paths."""
    names = [name for names_of_field in available.values() for name in names_of_field]
    mistakes = []
    for path, key in ((path, key) for path, key in keys.items() if path not in names):
        parent, near = path.rpartition(".")[0], nearest(path, names)
        beside = sorted({name.rpartition(".")[2] for name in names if parent and name.rpartition(".")[0] == parent})
        allowed, repair = "needs the dotted path of a value of the study", "fingerslip show STUDY lists all paths"
        # A name that is like none of its group is better answered by the names of the group.
        if near in {None, parent} and beside:
            allowed, repair = f"{parent} may have {', '.join(beside)}", ""
        elif near:
            repair = guesses(path, names) or f"did you mean '{near}'?"
        fault = "is not known" if key == path else f"has '{path}', which is not known"
        mistakes.append(InputError(f"{group}.{key}", fault, allowed, repair))
    return mistakes


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


_SCATTER_DIGITS, _DIGITS = 6, 5
_MOST = 100_000  # samples; planning takes 13 ms for each


def _check_scatter(scatter: Mapping[str, Any]) -> Mapping[str, Any]:
    if not scatter:
        raise InputError("", "is empty", "needs a standard deviation by dotted path", "all repeats are alike")
    for path, deviation in scatter.items():
        quantity = quantity_of(deviation)
        if quantity is None or not 0.0 < quantity[0] < math.inf:
            fault, allowed = f"got {shorten(repr(deviation))}", "needs a standard deviation above 0"
            raise InputError(path, fault, allowed, "write a number, or a quantity such as '0.1 mm'")
    return scatter


@parameters
class RepeatSettings:
    """Repeats of every run."""

    count: Annotated[int, pydantic.Field(ge=1, le=_MOST), "How many."]
    scatter: Annotated[
        Mapping[str, Any],
        pydantic.AfterValidator(_check_scatter),
        "Standard deviations by dotted path, numbers or quantities. In each repeat the value is drawn from a normal "
        "distribution around that of the run; the draws of a repeat are the same in all runs.",
    ]
    seed: Annotated[
        int,
        pydantic.Field(ge=0),
        "Seed of all random numbers. Each repeat has a seed of its own, which follows from this one and its number.",
    ] = 1


def scatter_values(settings: RepeatSettings, number: int, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a repeat, which numbers from 1, by dotted path, as a study file writes them."""
    seed = int(np.random.SeedSequence([settings.seed, number]).generate_state(1)[0])
    draws = np.random.default_rng(seed).standard_normal(len(settings.scatter))
    result = {}
    for (path, deviation), draw in zip(settings.scatter.items(), draws, strict=True):
        where, quantity, spread = f"repeats.scatter.{path}", quantity_of(values.get(path)), quantity_of(deviation)
        if quantity is None:
            fault = "is not known" if values.get(path) is None else f"leads to {shorten(repr(values.get(path)))}"
            raise InputError(where, fault, "needs the dotted path of a number", "fingerslip show STUDY lists all paths")
        if spread is None or spread[1] != quantity[1]:
            needed = f"needs a unit of [{quantity[1] or 'a pure number'}]"
            raise InputError(where, f"got {shorten(repr(deviation))}", needed)
        result[path] = _round(quantity[0] + float(draw) * spread[0], _SCATTER_DIGITS, quantity[1])
    return result


def _round(number: float, digits: int, unit: str) -> str | float:
    """Return a number as a study file writes it."""
    text = f"{number:.{digits}g}"
    return f"{text} {unit}" if unit else float(text)


def _check_ranges(ranges: Mapping[str, tuple[Any, ...]]) -> Mapping[str, tuple[Any, ...]]:
    if not ranges:
        raise InputError("", "is empty", "needs a range by dotted path", "write path: [smallest, largest]")
    mistakes = Mistakes()
    for path, ends in ranges.items():
        with mistakes.collect():
            if len(ends) != 2:
                raise InputError(path, f"has {len(ends)} values", "needs two: [smallest, largest]")
            (low, unit), (high, other) = (_number_and_unit(path, end) for end in ends)
            if unit != other:
                raise InputError(path, f"goes from '{ends[0]}' to '{ends[1]}'", "needs both ends in the same unit")
            if not low < high:
                order = "needs the smallest value first, then the largest"
                raise InputError(path, f"goes from {ends[0]} to {ends[1]}", order)
    mistakes.raise_all()
    return ranges


def _number_and_unit(path: str, value: object) -> tuple[float, str]:
    """Return the number of an end of a range in its own unit, which is empty for a plain number."""
    quantity = split_quantity(value) if isinstance(value, str) else quantity_of(value)
    if quantity is None:
        raise InputError(path, f"got {shorten(repr(value))}", "needs numbers or quantities", "sweep what has no order")
    return quantity


def _check_choices(choices: Mapping[str, tuple[Any, ...]]) -> Mapping[str, tuple[Any, ...]]:
    for path, values in choices.items():
        if len(values) < 2:
            raise InputError(path, f"has {len(values)} values", "needs two or more")
        _check_different(path, values)
    return choices


@parameters
class SampleSettings:
    """Samples of values that are known by their ranges only.

    In a Latin hypercube every range is cut into `count` equal parts, and every part holds the value of one sample;
    which parts of different ranges come together is drawn at random.
    """

    ranges: Annotated[
        Mapping[str, tuple[Any, ...]],
        pydantic.AfterValidator(_check_ranges),
        "Smallest and largest value by dotted path, quantities in one unit.",
    ]
    count: Annotated[
        int, pydantic.Field(ge=2), "Number of samples; with `saltelli` and `morris` the number of their blocks."
    ]
    seed: Annotated[
        int, pydantic.Field(ge=0), "Seed of the random numbers: the same settings give the same samples."
    ] = 1
    method: Annotated[
        Method,
        "A Latin hypercube; a scrambled Sobol sequence, whose `count` has to be a power of two; independent values; "
        "or a design for sensitivities: `saltelli` for Sobol indices, `count` (a power of two) times two samples more "
        "than there are values, or `morris` for elementary effects, `count` times one more.",
    ] = "latin_hypercube"
    choices: Annotated[
        Mapping[str, tuple[Any, ...]],
        pydantic.AfterValidator(_check_choices),
        "Values without order, such as words, by dotted path; each is drawn equally often, but for the last of three "
        "with `morris`, which has four levels, and no more choices than these: twice as often.",
    ] = pydantic.Field(default_factory=dict)
    equal: Annotated[
        Mapping[str, str],
        "Dotted paths of further values, which are the same as a sampled one, by the path of that one.",
    ] = pydantic.Field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.method in ("sobol", "saltelli") and self.count & (self.count - 1):
            below = 1 << (self.count.bit_length() - 1)
            repair = f"write count: {below} or count: {2 * below}"
            raise InputError("count", f"got {self.count} for a Sobol sequence", "needs a power of two", repair)
        if self.total > _MOST:
            raise InputError("count", f"makes {self.total} samples", f"needs {_MOST} or fewer")
        self._check_unordered()
        for path, other in self.equal.items():
            if other not in self.paths:
                raise InputError(f"equal.{path}", f"got '{other}'", f"needs one of {', '.join(self.paths)}")
            if path in self.paths:
                raise InputError(f"equal.{path}", "is sampled itself", "needs the path of a value without a range")
        # Of a path inside another one, which of the two values counts would depend on their order.
        groups = {path: group for group in ("ranges", "choices", "equal") for path in getattr(self, group)}
        for path, outer in itertools.permutations(groups, 2):
            if is_below(path, outer):
                fault, allowed = f"is a part of the sampled '{outer}'", "needs paths apart from each other"
                raise InputError(f"{groups[path]}.{path}", fault, allowed)

    def _check_unordered(self) -> None:
        for path, values in self.choices.items():
            if path in self.ranges:
                raise InputError(f"choices.{path}", "has a range too", "needs a path of its own")
            if self.method == "morris" and len(values) > LEVELS:
                fault, allowed = f"has {len(values)} values", f"may have {LEVELS}, the levels of morris"
                raise InputError(f"choices.{path}", fault, allowed, "use saltelli, or leave some out")

    @property
    def paths(self) -> tuple[str, ...]:
        """Dotted paths of the sampled values: those with ranges, then those with choices."""
        return (*self.ranges, *self.choices)

    @property
    def total(self) -> int:
        """The number of samples."""
        return self.count * block_size(self.method, len(self.paths))

    @property
    def design(self) -> dict[str, Any]:
        """How the samples are drawn, as plain data."""
        return {"method": self.method, "count": self.count, "seed": self.seed, "paths": list(self.paths)}

    def values(self, sampled: Mapping[str, Any]) -> dict[str, Any]:
        """Return all values that a sample sets, by dotted path: the drawn ones and those that are equal to them."""
        return {**sampled, **{path: sampled[other] for path, other in self.equal.items() if other in sampled}}


def drawn(settings: SampleSettings) -> tuple[dict[str, Any], ...]:
    """Return the samples: values by dotted path, as a study file writes them, five digits each."""
    samples: list[dict[str, Any]] = []
    for shares in draw_shares(settings.method, settings.count, len(settings.paths), settings.seed).tolist():
        samples.append({})
        for path, share in zip(settings.paths, shares, strict=True):
            if path in settings.choices:
                values = settings.choices[path]
                samples[-1][path] = values[min(int(share * len(values)), len(values) - 1)]
            else:  # in the unit of the ends of its range
                (low, unit), (high, _) = (_number_and_unit("", end) for end in settings.ranges[path])
                samples[-1][path] = _round(low + share * (high - low), _DIGITS, unit)
    return tuple(samples)


def sample_mistakes(
    plain: Mapping[str, Any], mistakes: Sequence[InputError], paths: Mapping[str, Sequence[str]], check: Check
) -> list[InputError]:
    """Return the mistakes in the ranges and choices of a study: paths that lead nowhere, and wrong ends and choices.

    Arguments as of :func:`~fingerslip.study.definition.sweep.swept_mistakes`. An end is wrong where the study with this
    value, and its other values as they stand, is wrong. What is wrong between the ends, where several values come
    together, refuses the sample and not the study.
    """
    if any(is_below(mistake.where, SAMPLE) for mistake in mistakes):
        return []
    # Of a field that is wrong no path is known, but what a value at it is answered.
    wrong_fields = {mistake.where.partition(".")[0] for mistake in mistakes} - paths.keys()
    groups = {group: plain[SAMPLE].get(group) or {} for group in ("ranges", "choices", "equal")}
    unknown = [
        mistake
        for group, values in groups.items()
        for mistake in unknown_paths(
            {path: path for path in values if path.partition(".")[0] not in wrong_fields}, paths, f"sample.{group}"
        )
    ]
    misnamed, elsewhere = ({mistake.where for mistake in mistakes_of} for mistakes_of in (unknown, mistakes))
    equal = {path: other for path, other in groups["equal"].items() if f"sample.equal.{path}" not in misnamed}
    values = [
        InputError(
            f"sample.{group}.{path}" if is_name else f"sample.{group}.{path}.{number}",
            mistake.found if mistake.where == path else f"makes {mistake.where} wrong: {mistake.found}",
            mistake.allowed,
            mistake.repair,
        )
        for group in ("ranges", "choices")
        for path, ends in groups[group].items()
        if f"sample.{group}.{path}" not in misnamed
        and (plain.get(field := path.partition(".")[0]) or field not in wrong_fields)
        and _leads_to(plain, path, ends)
        for number, value in enumerate(ends)
        for mistake in check(dict.fromkeys((path, *(twin for twin, other in equal.items() if other == path)), value))
        if mistake.where not in elsewhere
        and not (is_name := (mistake.where, mistake.found) == (path, "is not known")) * number
    ]
    return [*unknown, *values]
