"""Published values that ship."""

import pytest

from fingerslip.errors import InputError
from fingerslip.published import published_names, published_set

PROGRAMME = {
    "programme.0.press.depth": "0.0015 m",
    "programme.0.press.speed": "0.0015 m/s",
    "programme.1.slide.speed": "0.003 m/s",
    "programme.1.slide.direction.0": -1.0,
    "programme.1.slide.direction.1": 0.0,
}
SETS = [published_set(name) for name in published_names()]


def test_table2_is_as_printed():
    values = {value.id: (value.value, value.unit) for value in published_set("wang2014-table2").values}
    assert values["original-overall"] == (1.71, "s")
    assert values["scaled-latency"] == (0.29, "s")
    assert len(values) == 9


def test_latencies_agree_with_their_events_to_the_printed_digit():
    values = {value.id: value.value for value in published_set("wang2014-table2").values}
    for variant in ("original", "flattened", "scaled"):
        overall, incipient, latency = (values[f"{variant}-{name}"] for name in ("overall", "incipient", "latency"))
        assert overall - incipient == pytest.approx(latency, abs=1e-9)


def test_derived_ways_follow_from_table2():
    overall = {v.id.split("-")[0]: v.value for v in published_set("wang2014-table2").values if v.quantity == "overall"}
    for value in published_set("wang2014-derived").values:
        variant = value.id.split("-")[0]
        assert (overall[variant] - 1.0) * 3.0 / (0.6 * 1.5) == pytest.approx(value.value, abs=6e-3)
        assert value.kind == "derived"


def test_conditions_are_those_of_group_and_row():
    value = published_set("wang2014-table2").values[0]
    run = {
        "fingertip.phalanx.variant": "original",
        "fingertip.fingerprint.enabled": False,
        "contact.friction_coefficient": 0.6,
        **PROGRAMME,
    }
    assert value.holds_for({**run, "time.step": "5 ms"})
    assert not value.holds_for({**run, "contact.friction_coefficient": 0.4})
    assert not value.holds_for({"fingertip.phalanx.variant": "original"})


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("programme.0.press.depth", "2 mm"),
        ("programme.0.press.speed", "0.002 m/s"),
        ("programme.1.slide.speed", "5 mm/s"),
        ("programme.1.slide.speed", "3 mm"),
        ("programme.1.slide.direction.0", 1.0),
        ("programme.1.slide.direction.0", None),
    ],
)
def test_times_hold_for_the_programme_of_the_paper_alone(path, value):
    published_value = published_set("wang2014-table2").values[0]
    run = {**published_value.conditions, **PROGRAMME}
    assert published_value.unmet(run) == {}
    assert list(published_value.unmet({**run, path: value})) == [path]


def test_finger_in_space_at_an_angle_is_not_the_published_one():
    value = published_set("wang2014-solid").values[0]
    run = {**value.conditions, **value.programme}
    assert value.holds_for({**run, "fingertip.solid.angle": "0.0 deg"})
    assert list(value.unmet({**run, "fingertip.solid.angle": "-10 deg"})) == ["fingertip.solid.angle"]


def test_range_has_its_middle_as_value():
    value = next(v for v in published_set("wang2014-peaks").values if v.quantity == "three_quarter")
    assert value.span == (1.63, 1.65)
    assert value.value == pytest.approx(1.64)


def test_every_row_has_an_identity_a_source_and_a_value_or_a_statement():
    rows = [value for every in SETS for value in every.values]
    assert len({value.id for value in rows}) == len(rows)
    for value in rows:
        assert value.source.startswith(("wang2014, ", "bulens2023, "))
        assert (value.value is None) == (value.kind == "qualitative") == bool(value.statement) == bool(value.check)


def test_unknown_set_names_the_nearest():
    with pytest.raises(InputError, match="did you mean 'wang2014-table2'"):
        published_set("wang2014-table-2")
