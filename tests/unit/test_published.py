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
TABLE2 = published_set("wang2014-table2").values


def test_table2_is_as_printed_and_latencies_and_ways_follow_from_it():
    values = {value.id: (value.value, value.unit) for value in TABLE2}
    assert values["original-overall"] == (1.71, "s")
    assert values["scaled-latency"] == (0.29, "s")
    assert len(values) == 9
    for variant in ("original", "flattened", "scaled"):
        overall, incipient, latency = (values[f"{variant}-{name}"][0] for name in ("overall", "incipient", "latency"))
        assert overall - incipient == pytest.approx(latency, abs=1e-9)
    for value in published_set("wang2014-derived").values:
        overall, _ = values[f"{value.id.split('-')[0]}-overall"]
        assert (overall - 1.0) * 3.0 / (0.6 * 1.5) == pytest.approx(value.value, abs=6e-3)
        assert value.kind == "derived"
    value = next(v for v in published_set("wang2014-peaks").values if v.quantity == "three_quarter")
    assert (value.span, value.value) == ((1.63, 1.65), pytest.approx(1.64)), "a range has its middle as value"


def test_conditions_are_those_of_group_and_row():
    value = TABLE2[0]
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
    run = {**TABLE2[0].conditions, **PROGRAMME}
    assert TABLE2[0].unmet(run) == {}
    assert list(TABLE2[0].unmet({**run, path: value})) == [path]


def test_finger_in_space_at_an_angle_is_not_the_published_one():
    value = published_set("wang2014-solid").values[0]
    run = {**value.conditions, **value.programme}
    assert value.holds_for({**run, "fingertip.solid.angle": "0.0 deg"})
    assert list(value.unmet({**run, "fingertip.solid.angle": "-10 deg"})) == ["fingertip.solid.angle"]


def test_every_row_has_an_identity_a_source_and_a_value_or_a_statement():
    rows = [value for name in published_names() for value in published_set(name).values]
    assert len({value.id for value in rows}) == len(rows)
    for value in rows:
        assert value.source.startswith(("wang2014, ", "bulens2023, "))
        assert (value.value is None) == (value.kind == "qualitative") == bool(value.statement) == bool(value.check)
    with pytest.raises(InputError, match="did you mean 'wang2014-table2'"):
        published_set("wang2014-table-2")
