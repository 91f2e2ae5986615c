"""Derived quantities: their values, units and mistakes."""

import pytest

from fingerslip.errors import InputError
from fingerslip.results import Quantity, RunResult
from fingerslip.slip.events import Events, SlipEvents
from fingerslip.study.definition.expressions import check_expression, check_names, derive
from fingerslip.study.definition.spec import read_study
from unit.study.block import block_values

RUN = RunResult(
    "run",
    {"contact.friction_coefficient": 0.5},
    Events(slip=SlipEvents(incipient=1.2, overall=1.7)),
    numbers={"contact_area_max_m2": 1e-4},
    values={"programme.0.press.speed": "1.5 mm/s", "programme.1.slide.speed": "3 mm/s", "title": "x"},
)


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("overall_slip * slide_speed", 5.1e-3, "m"),
        ("latency * programme.1.slide.speed / '1 mm'", 1.5, ""),
        ("sqrt(contact_area_max) * friction_coefficient", 5e-3, "m"),
        ("overall_slip - '0.7 s'", 1.0, "s"),
        ("max(slide_speed, press.speed)**2 / contact_area_max", 0.09, "1/s^2"),
        ("log(friction_coefficient) + 2e0", 1.3068528, ""),
        ("-(1 + 1)", -2.0, ""),
        *(("log(1e300)", 690.7755, ""), ("exp(30)", 1.068647e13, ""), ("2 ** 30", 2.0**30, "")),
    ],
)
def test_an_expression_has_a_value_and_a_unit(text, value, unit):
    found = derive("x", check_expression(text), RUN)
    assert found.value == pytest.approx(value)
    assert found.unit == unit


@pytest.mark.parametrize(
    ("text", "said"),
    [
        *((text, None) for text in ("__import__('os')", "().__class__", "[1][0]", "lambda: 1", "1 if 2 else 3")),
        *((text, None) for text in ("a = 1", "'3 apples'", "max(a, key=b)", "1 +")),
        ("-" * 2000 + "1", "needs 500 or fewer"),
        ("min(latency)", "needs two values or more"),
        ("sqrt()", "needs one value"),
        ("1e999", "too large"),
    ],
)
def test_what_is_no_expression_is_refused(text, said):
    with pytest.raises(InputError, match=said):
        check_expression(text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("speed * 2", "'speed' stands for programme.0.press.speed, programme.1.slide.speed"),
        ("nothing", "'nothing' is not known"),
        ("overall_slip + slide_speed", "needs units that fit together"),
        ("2 ** latency", "a number in s stands where a pure one is needed"),
        ("'2 mm' ** (three_quarter_slip / '1 s')", "known exponent"),
        *(("max", "is not known"), ("breadth + é", "is not known")),
    ],
)
def test_wrong_names_and_units_are_refused(text, said):
    with pytest.raises(InputError, match=r"derived\.x") as caught:
        derive("x", check_expression(text), RUN)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("three_quarter_slip * slide_speed", "m"),
        ("1 / (latency - latency)", "1/s"),
        ("sqrt(overall_slip - '1.8 s')", "s^0.5"),
        ("log(latency / '1 s' - 1)", ""),
        ("1 / 0", ""),
    ],
)
def test_what_has_no_value_has_a_unit(text, unit):
    assert derive("x", check_expression(text), RUN) == Quantity("x", unit, None)
    # Without the events a root of (overall_slip - 1.5 s) is as possible as with them.
    assert derive("x", "sqrt(overall_slip - '1.5 s')", RunResult("run", {}, Events())) == Quantity("x", "s^0.5", None)


NAMES = {
    **dict.fromkeys(
        ["overall_slip", "overall", "latency_displacement", "normal_force_max", "sample"], "a name of its own"
    ),
    **dict.fromkeys(["a, b", "2nd", "", "_x", "é"], "is no name of a column"),
}


@pytest.mark.parametrize(("name", "said"), NAMES.items())
def test_names_are_those_of_columns_and_of_nothing_else(name, said):
    with pytest.raises(InputError, match=f"{name}.*{said}"):
        check_names({name: "latency"})


def test_study_files_are_held_to_these_names(write_study):
    with pytest.raises(InputError, match=r"derived\.overall: "):
        read_study(write_study(block_values() | {"derived": {"overall": "latency"}}))
