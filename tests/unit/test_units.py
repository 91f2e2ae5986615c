"""Quantities with units."""

import itertools

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fingerslip import units
from fingerslip.errors import InputError
from fingerslip.units import Unit, format_quantity, parse_quantity

UNITS = [("m", "mm"), ("m", "um"), ("s", "ms"), ("m/s", "mm/s"), ("Pa", "kPa"), ("kg/m^3", "g/cm^3"), ("rad", "deg")]
numbers = st.floats(min_value=1e-9, max_value=1e9)


@pytest.mark.parametrize(
    ("text", "si", "value"),
    [
        ("1.5 mm", "m", 0.0015),
        ("1.5mm", "m", 0.0015),
        ("  -2 mm ", "m", -0.002),
        ("34 kPa", "Pa", 34e3),
        ("1.5e-1 mm", "m", 0.00015),
        (".5 s", "s", 0.5),
        ("3 mm/s", "m/s", 0.003),
        ("1 g/cm^3", "kg/m^3", 1000.0),
        ("180 deg", "rad", 3.141592653589793),
    ],
)
def test_text_becomes_si(text, si, value):
    assert parse_quantity(text, si) == pytest.approx(value, rel=1e-14)


@given(digits=st.integers(1, 99999), places=st.integers(0, 4))
def test_decimal_text_stays_exact(digits, places):
    """Text in mm must give the very float that the same length written in m gives."""
    assert parse_quantity(f"{digits}e-{places} mm", "m") == float(f"{digits}e-{places + 3}")


@given(value=numbers, pair=st.sampled_from(UNITS))
def test_what_is_formatted_is_parsed_back_with_six_digits_and_in_si_with_all(value, pair):
    si, display = pair
    assert parse_quantity(format_quantity(value, si, display), si) == pytest.approx(value, rel=1e-5)
    assert parse_quantity(f"{value!r} {si}", si) == value
    unit = Unit(*pair)
    assert float(unit.format(value).split()[0]) == pytest.approx(unit.to_display(value), rel=1e-5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1.5", "'1.5' has no unit, needs a unit of [m]; write '1.5 mm' or '1.5 m'"),
        ("3 kg", "got '3 kg', needs a unit of [m]; write for example '3 mm'"),
        ("3 furlongz", "got '3 furlongz', needs a unit of [m]; write for example '3 mm'"),
        ("3 MM", "got '3 MM', needs a unit of [m]; did you mean '3 mm'?"),
        ("1,5 mm", "got '1,5 mm', needs a decimal point, not a comma; write '1.5 mm'"),
        ("mm", "'mm' is not a quantity, needs a number and a unit such as '1.5 mm'"),
        ("", "'' is not a quantity, needs a number and a unit such as '1.5 mm'"),
        ("nan mm", "'nan mm' is not a quantity, needs a number and a unit such as '1.5 mm'"),
    ],
)
def test_mistakes_show_the_repair(text, message):
    with pytest.raises(InputError) as caught:
        parse_quantity(text, "m", example="mm", where="depth")
    assert str(caught.value) == f"depth: {message}"
    with pytest.raises(InputError) as caught:
        parse_quantity("1", "s")
    assert caught.value.repair == "write '1 s'", "a unit of SI is not offered twice"
    with pytest.raises(InputError, match="write for example '5 GPa/m'"):
        parse_quantity("5 GPa", "Pa/m")


@given(text=st.text(max_size=20))
@example(text="0)")
def test_any_text_gives_a_number_or_one_clear_error(text):
    places = []
    try:
        value = parse_quantity(text, "m")
    except InputError as error:
        places.append(error.where)
        value = None
    assert isinstance(value, float) or places == ["quantity"]


def test_numbers_beyond_a_computer_and_units_that_have_to_be_calculated_are_refused_and_long_text_shown_cut():
    for number in ("1e99999999999999999999", "-1e99999999999999999999", "1e-99999999999999999999", "1e400"):
        for unit, si in (("mm", "m"), ("m", "m"), ("kPa", "Pa")):
            with pytest.raises(InputError, match=rf"got '{number} {unit}', needs a number that a computer can hold"):
                parse_quantity(f"{number} {unit}", si)
    for unit in ("mm/0", "m*9**9**9", "m^9^9^9", "m**(9**9**9)", "m*9", "m^99", "m (", "0", "m**-1**-1"):
        with pytest.raises(InputError, match=r"needs a unit of \[m\]; write for example '5 m'"):
            parse_quantity(f"5 {unit}", "m")
    for text in ("9" * 5000, "9" * 5000 + " mm", "9 " + "m" * 5000, "x" * 5000):
        with pytest.raises(InputError) as caught:
            parse_quantity(text, "m")
        assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("answers", "expected"),
    [
        (map(units.split_quantity, ("-15 deg", "scaled", "0.6")), [(-15.0, "deg"), None, None]),
        (map(units.without_rounding, ("0.6000000000000001 mm", "0.1234567891")), ["0.6 mm", "0.1234567891"]),
        (map(units.si_quantity, ("3 mm/s", "34 kPa", "scaled")), [(0.003, "m/s"), (34000.0, "Pa"), None]),
        (map(units.quantity_of, (0.6, "3 mm/s", True)), [(0.6, ""), (0.003, "m/s"), None]),
        ([units.si_number(units.with_unit(2.0, "s") * units.with_unit(3.0, "mm/s"))], [(0.006, "m")]),
        (map(units.unit_suffix, ("kg/m^3", "1/s", "N m")), ["kg_per_m3", "per_s", "N_m"]),
        ([format_quantity(0.0015, "m", "mm"), units.millimetres(0.00123456)], ["1.5 mm", "1.235 mm"]),
        ([units.coordinates((0.001, -0.0065))], ["x = 1 mm, y = -6.5 mm"]),
    ],
)
def test_quantities_are_split_converted_and_written(answers, expected):
    assert list(answers) == expected


def test_known_factors_are_those_of_pint():
    for unit, si in itertools.product(units._FACTORS, units._OF_MECHANICS):
        assert units._factor(unit, si) == units._computed_factor(unit, si), (unit, si)
        assert units._factor(si, unit) == units._computed_factor(si, unit), (si, unit)
