"""Quantities with units: text such as ``1.5 mm`` to SI floats, and back for tables and errors."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from decimal import Decimal, DecimalException
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

from fingerslip.errors import InputError, shorten

if TYPE_CHECKING:
    import pint
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
    from pydantic_core import CoreSchema

#: Units in which files may hold coordinates, and their metres.
LengthUnit = Literal["m", "cm", "mm", "um"]
METRES: Mapping[str, float] = MappingProxyType({"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6})

# The SI units of the quantities that studies have, one of each dimension.
_OF_MECHANICS = (
    *("m", "s", "kg", "rad", "N", "Pa", "m/s", "rad/s", "m/s^2", "m^2", "kg/m^3", "Pa/m", "N/m", "N s/m"),
    *("N m", "N m s", "kg m^2"),
)
# Factors of the units that most studies have, as pint computes them, which is slow to import.
_FACTORS: Mapping[str, tuple[str, float]] = MappingProxyType(
    {unit: (unit, 1.0) for unit in _OF_MECHANICS}
    | {unit: ("m", factor) for unit, factor in METRES.items()}
    | {
        "ms": ("s", 1e-3),
        "g": ("kg", 1e-3),
        "mN": ("N", 1e-3),
        "kPa": ("Pa", 1e3),
        "MPa": ("Pa", 1e6),
        "GPa": ("Pa", 1e9),
        "GPa/m": ("Pa/m", 1e9),
        "mm/s": ("m/s", 1e-3),
        "deg": ("rad", 0.017453292519943295),
        "mm^2": ("m^2", 1e-6),
    }
)
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
# A number and the beginning of a unit, as JSON Schema writes patterns.
_WITH_UNIT = r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?(\s+1 ?/|\s*(?![eE][-+]?\d)[^\s\d.])"
_FRACTION = re.compile(r"(?<![\w.])\d*\.\d+(?:[eE][-+]?\d+)?(?![\d.])")
_COMMA = re.compile(r",\d")
_NOT_ZERO = re.compile(r"[-+.0]*[1-9]")
# Numbers stand in units as exponents alone, of one digit: others would be calculated, 9**9**9 for hours.
_UNIT = re.compile(r"(?:[^\W\d_]\w*|[ ()/*%°Ωµ·-]|(?:\*\*|\^) ?-?\d(?!\w| ?\*\*| ?\^)|1 ?/)+")


@functools.cache
def _registry() -> pint.UnitRegistry[Any]:
    import pint

    return pint.UnitRegistry()


@functools.cache
def _factor(unit: str, si: str) -> float | None:
    """Return the factor from `unit` to `si`; None where `unit` is unknown or of another dimension."""
    if unit == si:
        return 1.0
    if unit in _FACTORS and si in _OF_MECHANICS:
        dimension, factor = _FACTORS[unit]
        return factor if dimension == si else None
    # From SI to a unit that tables show.
    if unit in _OF_MECHANICS and si in _FACTORS:
        dimension, factor = _FACTORS[si]
        return 1.0 / factor if dimension == unit else None
    return _computed_factor(unit, si)


def _computed_factor(unit: str, si: str) -> float | None:
    if not _UNIT.fullmatch(unit):
        return None
    import tokenize

    import pint

    # What pint raises at text that is no unit depends on where its parser, Python's tokenizer, gives up.
    of_python = (AttributeError, AssertionError, ValueError, TypeError, ArithmeticError)
    wrong = (pint.errors.PintError, tokenize.TokenError, *of_python)
    try:
        return float(_registry().Quantity(1.0, unit).to(si).magnitude)
    except wrong:
        return None


def metres(unit: str) -> float:
    """Return the metres of a unit of coordinates; refuse any other than m, cm, mm and um."""
    if unit not in METRES:
        raise InputError("unit", f"got {unit!r}", f"needs one of {', '.join(METRES)}")
    return METRES[unit]


def parse_quantity(text: str, si: str, *, example: str = "", where: str = "quantity") -> float:
    """Read a quantity with its unit into an SI float."""
    unit_example = example or si
    match, text_shown = _QUANTITY.fullmatch(text), shorten(text)
    if match is None:
        raise InputError(
            where, f"'{text_shown}' is not a quantity", f"needs a number and a unit such as '1.5 {unit_example}'"
        )
    number, unit = match.groups()
    if not unit:
        raise _no_unit(number, si, unit_example, where)
    factor = _factor(unit, si)
    if _COMMA.match(unit) and number.isdecimal():
        repair = f"write '{shorten(number + unit.replace(',', '.', 1))}'"
        raise InputError(where, f"got '{text_shown}'", "needs a decimal point, not a comma", repair)
    if factor is None:
        # GPa where GPa/m is due keeps its prefix.
        whole = f"{unit}/{si.partition('/')[2]}"
        repair = f"write for example '{shorten(number)} {whole if _factor(whole, si) else unit_example}'"
        # Another unit would be another magnitude where only capitals are wrong.
        for other, (dimension, _) in _FACTORS.items():
            if other.casefold() == unit.casefold() and dimension == si:
                repair = f"did you mean '{shorten(number)} {other}'?"
        raise InputError(where, f"got '{text_shown}'", f"needs a unit of [{si}]", repair)
    value = _scale(number, factor)
    if not math.isfinite(value) or (value == 0.0 and _NOT_ZERO.match(number)):
        raise InputError(
            where, f"got '{text_shown}'", "needs a number that a computer can hold, between 1e-300 and 1e300"
        )
    return value


def _scale(number: str, factor: float) -> float:
    """Return a number in decimal text times a factor; infinite where that is too large."""
    # Decimal arithmetic keeps decimal text exact: 0.13 mm is 0.00013, not 0.00013000000000000002.
    inverse = round(1.0 / factor) if factor else 0
    if inverse <= 1 or 1.0 / inverse != factor:
        return float(number) * factor
    try:
        return float(Decimal(number) / inverse)
    except DecimalException:  # an exponent beyond those of decimal numbers
        return math.inf


def _no_unit(number: object, si: str, example: str, where: str = "") -> InputError:
    """Return the error of a bare number; it names the SI unit too, in which the number may be meant."""
    text = shorten(str(number))
    repair = f"write '{text} {example}'" + (f" or '{text} {si}'" if si != example else "")
    return InputError(where, f"'{text}' has no unit", f"needs a unit of [{si}]", repair)


def split_quantity(text: str) -> tuple[float, str] | None:
    """Return the number and the unit of a quantity as they are written; None for text that is no quantity."""
    match = _QUANTITY.fullmatch(text)
    return (float(match[1]), match[2]) if match and match[2] else None


def without_rounding(text: str) -> str:
    """Return a text with twelve digits of each number, which leaves out the rounding of sums such as 0.1 + 0.2."""
    return _FRACTION.sub(lambda number: number[0] if len(number[0]) <= 14 else f"{float(number[0]):.12g}", text)


def si_quantity(text: str) -> tuple[float, str] | None:
    """Return the value of a quantity in SI and its unit there; None for text that is no quantity of mechanics."""
    split = split_quantity(text)
    if split is None:
        return None
    si = next((unit for unit in _OF_MECHANICS if _factor(split[1], unit) is not None), None)
    return None if si is None else (parse_quantity(text, si), si)


def quantity_of(value: object) -> tuple[float, str] | None:
    """Return the number [SI] and the SI unit of a number or of text with a unit; None for anything else."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value), ""
    return si_quantity(value) if isinstance(value, str) else None


def with_unit(value: float, unit: str) -> Any:
    """Return a number with its unit, to calculate with; :func:`si_number` reads the result."""
    return _registry().Quantity(value, unit)


def si_number(value: Any) -> tuple[float, str]:
    """Return the number of a calculated quantity in SI and its unit, which is empty for a pure number."""
    if not hasattr(value, "to_base_units"):
        return float(value), ""
    for unit in ("", *_OF_MECHANICS):
        if value.is_compatible_with(unit) and not unit.startswith("rad"):
            return float(value.to(unit).magnitude), unit
    base = value.to_base_units()
    return float(base.magnitude), f"{base.units:~}".replace(" ** ", "^").replace(" * ", " ").replace(" / ", "/")


def unit_suffix(si: str) -> str:
    """Return a unit as names of columns end in it, such as ``kg_per_m3``."""
    return re.sub(r"^1?/", "per_", si).replace("/", "_per_").replace("^", "").replace(" ", "_")


def format_quantity(value: float, si: str, display: str = "") -> str:
    """Write an SI value in its display unit with up to six digits."""
    factor = _factor(si, display) if display else 1.0
    return f"{value * (factor or 1.0):.6g} {display or si}"


def millimetres(length: float, digits: int = 4) -> str:
    """Write a length [m] in millimetres, as errors do."""
    return f"{length * 1e3:.{digits}g} mm"


def coordinates(position: Iterable[float], digits: int = 4) -> str:
    """Write the coordinates of a point [m] in millimetres, as errors do."""
    return ", ".join(f"{axis} = {millimetres(value, digits)}" for axis, value in zip("xyz", position, strict=False))


@dataclass(frozen=True)
class Unit:
    """The unit mark of a field: parses text, refuses bare numbers from files, feeds tables and schema."""

    si: str  # SI unit in which the program holds the value
    display: str = ""  # unit in which tables and errors show it

    @property
    def shown(self) -> str:
        """The unit that people read."""
        return self.display or self.si

    def format(self, value: float) -> str:
        """Write `value` (SI) in the display unit."""
        return format_quantity(value, self.si, self.display)

    def to_display(self, value: float) -> float:
        """Convert an SI value to the display unit."""
        return value * (_factor(self.si, self.shown) or 1.0)

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        from pydantic_core import core_schema

        def validate(value: object, info: core_schema.ValidationInfo) -> object:
            if isinstance(value, bool):
                raise InputError("", f"got {str(value).lower()}", f"needs a quantity such as '1.5 {self.shown}'")
            if isinstance(value, str):
                return parse_quantity(value, self.si, example=self.shown, where="")
            if info.context and info.context.get("from_text") and isinstance(value, int | float):
                raise _no_unit(value, self.si, self.shown)
            return value

        return core_schema.with_info_before_validator_function(validate, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        words = f"A quantity such as '1.5 {self.shown}'"
        return {"type": "string", "pattern": _WITH_UNIT, "description": words, "examples": [f"1.5 {self.shown}"]}
