"""Derived quantities: expressions of results and parameters, evaluated safely and with their units.

An expression has numbers, quantities in quotes, ``+ - * / **``, parentheses, the functions of :data:`FUNCTIONS`, and
names: an event (``overall_slip``, ``latency``, ``overall_slip_acceleration``), a measure without its unit
(``contact_area_max``), or a parameter, by its dotted path or the end of it, such as ``slide_speed`` for
``programme.1.slide.speed``.
"""

from __future__ import annotations

import ast
import functools
import math
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from fingerslip.errors import InputError
from fingerslip.results import REPEAT, SAMPLE, Quantity, RunResult
from fingerslip.sampling.designs import output_names, output_of
from fingerslip.slip.events import Events
from fingerslip.slip.windows import READINGS, TIMES
from fingerslip.units import quantity_of, si_number, si_quantity, with_unit

#: What may be called; logarithm and exponential take pure numbers.
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "abs": abs,
    "min": min,
    "max": max,
    "sqrt": lambda value: value**0.5,
    "log": lambda value: with_unit(np.log(_pure(value)), ""),
    "exp": lambda value: with_unit(np.exp(_pure(value)), ""),
}
_OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Pow: lambda base, exponent: _power(base, _pure(exponent)),
}
# Names with dots are no names of Python; text in quotes stays as it is.
_NAME = re.compile(r"'[^']*'|\"[^\"]*\"|(?<![\w.])[^\W\d]\w*(?:\.\w+)*")
_WORD = re.compile(r"[A-Za-z]\w*", re.ASCII)
_COLUMNS = ("run", SAMPLE, REPEAT, "readings_recorded", "refused")
_SEVERAL = ("min", "max")
_LONGEST = 500  # [characters], so that no nesting is deeper than Python's stack
_LARGEST_NUMBER, _LARGEST_EXPONENT = 1e300, 20.0
_ALLOWED = f"needs numbers, names, + - * / **, parentheses and {', '.join(FUNCTIONS)}"


def check_expression(text: str) -> str:
    """Return an expression that can be read; refuse any other, without knowing the names in it."""
    for node in ast.walk(_parse(text)[0]):
        match node:
            case ast.Constant(value=str() as value):
                if si_quantity(value) is None:
                    needed = "needs a number and a unit such as '1.5 mm'"
                    raise InputError("", f"'{text}': '{value}' is no quantity", needed)
            case ast.Constant(value=int() | float() as value):  # true and false are names
                if value > _LARGEST_NUMBER:
                    needed = f"needs numbers up to {_LARGEST_NUMBER:g}"
                    raise InputError("", f"'{text}' holds a number that is too large", needed)
            case ast.Call(func=ast.Name(id=function), args=args, keywords=[]) if function in FUNCTIONS:
                if len(args) < 2 if function in _SEVERAL else len(args) != 1:
                    needed = "two values or more" if function in _SEVERAL else "one value"
                    raise InputError("", f"'{text}' gives {function} {len(args)} values", f"needs {needed}")
            case ast.Expression() | ast.BinOp() | ast.UnaryOp() | ast.Name() | ast.Load():
                pass
            case _ if type(node) not in _OPERATORS:
                kind = type(node.value if isinstance(node, ast.Constant) else node).__name__
                raise InputError("", f"'{text}' holds what is not allowed ({kind})", _ALLOWED)
    return text


def check_names(expressions: Mapping[str, str]) -> Mapping[str, str]:
    """Return derived quantities whose names are words of their own: they name columns, and outputs of a run."""
    readings = {"" if reading == "slip" else f"_{reading}" for reading in READINGS}
    times = {f"{time}{reading}" for time in TIMES for reading in readings}
    of_summary = {*_COLUMNS, *FUNCTIONS, *times, *output_names(RunResult("", {}, Events()))}
    for name in expressions:
        if not _WORD.fullmatch(name):
            raise InputError(name, "is no name of a column", "needs letters, digits and '_', a letter first")
        if name in of_summary:
            raise InputError(name, "is the name of something else in the summary", "needs a name of its own")
    return expressions


def derive(name: str, text: str, result: RunResult) -> Quantity:
    """Return one derived quantity [SI]; without a value where an event did not happen, or as of a negative root."""
    tree, names = _parse(text)
    quantities: dict[str, tuple[float | None, str]] = {}
    for key, path in names.items():
        if output := output_of(result, path):
            quantities[key] = output.value, output.unit
        else:
            quantities[key] = _parameter(path, result.all_values, f"derived.{name}")
    try:
        numbers = {key: _number_in(value, unit) for key, (value, unit) in quantities.items()}
        with np.errstate(all="ignore"):
            number, unit = si_number(_value(tree.body, numbers))
    except (ValueError, TypeError, ArithmeticError) as error:
        raise InputError(f"derived.{name}", f"'{text}': {error}", "needs units that fit together") from None
    exists = all(value is not None for value, _ in quantities.values()) and math.isfinite(number)
    return Quantity(name, unit, number if exists else None)


def _number_in(value: float | None, unit: str) -> Any:
    """Return a number in a unit, which becomes infinite or no number where Python's own would raise."""
    return with_unit(np.float64(math.nan if value is None else value), unit)


@functools.lru_cache(maxsize=256)
def _parse(text: str) -> tuple[ast.Expression, dict[str, str]]:
    """Return the tree of an expression, and its names by what stands for them in the tree."""
    if len(text) > _LONGEST:
        raise InputError("", f"has {len(text)} characters", f"needs {_LONGEST} or fewer", "define parts of it")
    names: dict[str, str] = {}

    def stand_in(match: re.Match[str]) -> str:
        name, is_called = match[0], text[match.end() :].lstrip().startswith("(")
        if name[0] in "'\"" or (name in FUNCTIONS and is_called):
            return name
        key = f"_{len(names)}"
        names[key] = name
        return key

    try:
        return ast.parse(_NAME.sub(stand_in, text), mode="eval"), names
    except (SyntaxError, ValueError):
        raise InputError("", f"'{text}' is no expression", _ALLOWED) from None


def _value(node: ast.AST, names: Mapping[str, Any]) -> Any:
    match node:
        case ast.Constant(value=str() as text):
            return _number_in(*(si_quantity(text) or (0.0, "")))
        case ast.Constant(value=int() | float() as number):
            return _number_in(number, "")
        case ast.Name(id=key):
            return names[key]
        case ast.BinOp(left=left, op=op, right=right):
            return _OPERATORS[type(op)](_value(left, names), _value(right, names))
        case ast.UnaryOp(op=op, operand=operand):
            return _OPERATORS[type(op)](_value(operand, names))
        case ast.Call(func=ast.Name(id=function), args=args):
            return FUNCTIONS[function](*(_value(argument, names) for argument in args))
    raise InputError("", f"holds {type(node).__name__}", _ALLOWED)


def _pure(value: Any) -> np.float64:
    number, unit = si_number(value)
    if unit:
        raise ValueError(f"a number in {unit} stands where a pure one is needed")
    return np.float64(number)


def _power(base: Any, exponent: np.float64) -> Any:
    """Return a power; a base with a unit needs an exponent that no result decides, for the unit depends on it."""
    if si_number(base)[1] and not abs(exponent) <= _LARGEST_EXPONENT:
        raise ValueError(f"a quantity with a unit needs a known exponent of at most {_LARGEST_EXPONENT:g}")
    return base**exponent


def _parameter(name: str, values: Mapping[str, Any], where: str) -> tuple[float, str]:
    ending = f"_{name}".replace(".", "_")
    paths = [name] if name in values else [path for path in values if f"_{path}".replace(".", "_").endswith(ending)]
    numbers = {path: number for path in paths if (number := quantity_of(values[path])) is not None}
    if len(numbers) != 1:
        said = f"'{name}' stands for {', '.join(numbers)}" if numbers else f"'{name}' is not known"
        allowed = "needs events, measures without their unit, or numbers of the study"
        raise InputError(where, said, allowed, "fingerslip show STUDY lists all paths; write the whole path")
    return next(iter(numbers.values()))
