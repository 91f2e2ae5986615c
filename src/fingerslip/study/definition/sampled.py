"""Samples of values that are not known: what a study file says of them, how they are drawn, and what can be wrong."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any, Literal

import numpy as np
import pydantic
from numpy.typing import NDArray
from scipy.stats import qmc

from fingerslip.errors import InputError, Mistakes, shortened
from fingerslip.parameters import parameters
from fingerslip.parameters.dotted import is_below
from fingerslip.results import SAMPLE
from fingerslip.study.definition.swept import unknown_paths, with_values
from fingerslip.units import split_quantity

__all__ = ["SampleSettings", "drawn", "sample_mistakes"]

_GROUP, _EQUAL = "sample.ranges", "sample.equal"
_DIGITS = 5

#: What draws shares of the ranges in (0, 1), by the name of the method.
_METHODS: Mapping[str, Callable[[int, int], Any]] = MappingProxyType(
    {
        "latin_hypercube": lambda dim, seed: qmc.LatinHypercube(dim, seed=seed),
        "sobol": lambda dim, seed: qmc.Sobol(dim, seed=seed),
        "random": lambda dim, seed: _Independent(dim, np.random.default_rng(seed)),
    }
)


@dataclass(frozen=True)
class _Independent:
    """Independent uniform values, drawn as `scipy.stats.qmc` draws its samples."""

    dim: int
    generator: np.random.Generator

    def random(self, count: int) -> NDArray[np.float64]:
        """Return samples (count, dim)."""
        return self.generator.random((count, self.dim))


def _check_ranges(ranges: Mapping[str, tuple[Any, ...]]) -> Mapping[str, tuple[Any, ...]]:
    if not ranges:
        raise InputError("", "is empty", "needs a range by dotted path", "write path: [smallest, largest]")
    mistakes = Mistakes()
    for path, ends in ranges.items():
        with mistakes.collected():
            _check_range(path, ends, ranges)
    mistakes.raise_all()
    return ranges


def _check_range(path: str, ends: Sequence[Any], ranges: Mapping[str, Any]) -> None:
    if len(ends) != 2:
        raise InputError(path, f"has {len(ends)} values", "needs two: [smallest, largest]")
    (low, unit), (high, other) = (_number_and_unit(path, end) for end in ends)
    if unit != other:
        raise InputError(path, f"goes from '{ends[0]}' to '{ends[1]}'", "needs both ends in the same unit")
    if not low < high:
        raise InputError(path, f"goes from {ends[0]} to {ends[1]}", "needs the smallest value first, then the largest")
    inside = next((group for group in ranges if path != group and is_below(path, group)), None)
    if inside is not None:
        raise InputError(path, f"is a part of the sampled '{inside}'", "needs paths apart from each other")


def _number_and_unit(path: str, value: object) -> tuple[float, str]:
    """Return the number of an end of a range and its unit, which is empty for a plain number."""
    parts = split_quantity(value) if isinstance(value, str) else None
    if parts is not None:
        return parts
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value), ""
    raise InputError(path, f"got {shortened(repr(value))}", "needs numbers or quantities", "sweep what has no order")


Ranges = Annotated[Mapping[str, tuple[Any, ...]], pydantic.AfterValidator(_check_ranges)]


@parameters
class SampleSettings:
    """Samples of values that are known by their ranges only.

    In a Latin hypercube every range is cut into `count` equal parts, and every part holds the value of one sample;
    which parts of different ranges come together is drawn at random.

    Parameters
    ----------
    ranges : mapping of str to tuple
        Smallest and largest value by dotted path, quantities in one unit.
    count : int
        Number of samples.
    seed : int
        Seed of the random numbers: the same settings give the same samples.
    method : {'latin_hypercube', 'sobol', 'random'}
        A Latin hypercube; a scrambled Sobol sequence, whose `count` has to be a power of two; or independent values.
    equal : mapping of str to str
        Dotted paths of further values, which are the same as a sampled one, by the path of that one.
    """

    ranges: Ranges
    count: Annotated[int, pydantic.Field(ge=2)]
    seed: Annotated[int, pydantic.Field(ge=0)] = 1
    method: Literal["latin_hypercube", "sobol", "random"] = "latin_hypercube"
    equal: Mapping[str, str] = pydantic.Field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.method == "sobol" and self.count & (self.count - 1):
            below = 1 << (self.count.bit_length() - 1)
            repair = f"write count: {below} or count: {2 * below}"
            raise InputError("count", f"got {self.count} for a Sobol sequence", "needs a power of two", repair)
        for path, other in self.equal.items():
            if other not in self.ranges:
                raise InputError(f"equal.{path}", f"got '{other}'", f"needs one of {', '.join(self.ranges)}")
            if path in self.ranges:
                raise InputError(f"equal.{path}", "is sampled itself", "needs the path of a value without a range")

    def values(self, sampled: Mapping[str, Any]) -> dict[str, Any]:
        """Return all values that a sample sets, by dotted path: the drawn ones and those that are equal to them."""
        return {**sampled, **{path: sampled[other] for path, other in self.equal.items() if other in sampled}}


def drawn(settings: SampleSettings) -> tuple[dict[str, Any], ...]:
    """Return the samples: values by dotted path, as a study file writes them, five digits each.

    Examples
    --------
    >>> drawn(SampleSettings({"time.step": ("1 ms", "3 ms")}, count=2))
    ({'time.step': '1.4882 ms'}, {'time.step': '2.0495 ms'})
    """
    cube = _METHODS[settings.method](len(settings.ranges), settings.seed).random(settings.count)
    return tuple(
        {path: _between(ends, share) for (path, ends), share in zip(settings.ranges.items(), shares, strict=True)}
        for shares in cube
    )


def _between(ends: Sequence[Any], share: float) -> str | float:
    """Return the value at a share of a range, in the unit of its ends."""
    (low, unit), (high, _) = (_number_and_unit("", end) for end in ends)
    text = f"{low + share * (high - low):.{_DIGITS}g}"
    return f"{text} {unit}" if unit else float(text)


def sample_mistakes(
    study: Mapping[str, Any],
    known_mistakes: Sequence[InputError],
    known_paths: Mapping[str, Sequence[str]],
    mistakes_of: Callable[[Mapping[str, Any]], Sequence[InputError]],
) -> list[InputError]:
    """Return the mistakes in the ranges of a study: paths that lead nowhere, and ends that are wrong on their own.

    An end is wrong where the study with this value, and its other values as they stand, is wrong. What is wrong between
    the ends, where several values come together, refuses the sample and not the study.

    Parameters
    ----------
    study : mapping
        What a study file holds, right or wrong.
    known_mistakes : sequence of InputError
        The mistakes of the study without its samples.
    known_paths : mapping of str to sequence of str
        The paths that may be sampled, by the field of the study that they begin with.
    mistakes_of : callable
        Returns the mistakes of a study as plain data, with dotted paths as locations.
    """
    if any(is_below(mistake.where, SAMPLE) for mistake in known_mistakes):
        return []
    ranges, equal = study[SAMPLE]["ranges"], study[SAMPLE].get("equal") or {}
    wrong_fields = {mistake.where.partition(".")[0] for mistake in known_mistakes} - known_paths.keys()
    judged, followers = (
        [path for path in paths if path.partition(".")[0] not in wrong_fields] for paths in (ranges, equal)
    )
    unknown = [*unknown_paths(judged, known_paths, _GROUP), *unknown_paths(followers, known_paths, _EQUAL)]
    misnamed = {mistake.where for mistake in unknown}
    followed = {path: equal[path] for path in followers if f"{_EQUAL}.{path}" not in misnamed}
    known = {mistake.where for mistake in known_mistakes}
    ends = [
        _at_end(mistake, path, number)
        for path in judged
        if f"{_GROUP}.{path}" not in misnamed
        for number, end in enumerate(ranges[path])
        for mistake in mistakes_of(with_values(study, dict.fromkeys(_same(path, followed), end)))
        if mistake.where not in known
    ]
    return [*unknown, *ends]


def _same(path: str, equal: Mapping[str, str]) -> tuple[str, ...]:
    """Return the paths of all values that are equal to a sampled one, that one first."""
    return (path, *(other for other, own in equal.items() if own == path))


def _at_end(mistake: InputError, path: str, number: int) -> InputError:
    found = mistake.found if mistake.where == path else f"makes {mistake.where} wrong: {mistake.found}"
    return InputError(f"{_GROUP}.{path}.{number}", found, mistake.allowed, mistake.repair)
