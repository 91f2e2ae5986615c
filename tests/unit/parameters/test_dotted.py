"""Dotted paths in nested plain data."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.parameters.dotted import assign, flatten, known_part, nearest, walk

keys = st.sampled_from(["a", "b", "c"])
plain = st.dictionaries(
    keys,
    st.recursive(st.integers(), lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3)),
)


def at(values, path):
    for key in path.split("."):
        values = values[int(key)] if isinstance(values, list) else values[key]
    return values


@given(values=plain)
def test_every_path_leads_to_a_value_that_can_be_replaced(values):
    for path in list(walk(values)):
        at(values, path)
    for path in reversed(list(walk(values))):
        assign(values, path, "new")
        assert at(values, path) == "new"


def test_groups_come_before_what_they_hold():
    assert list(walk({"b": {"d": 1, "c": [2, {"e": 3}]}, "a": ()})) == [
        "b",
        "b.d",
        "b.c",
        "b.c.0",
        "b.c.1",
        "b.c.1.e",
        "a",
    ]


def test_missing_groups_are_made_and_empty_ones_filled():
    values = {"contact": None}
    assign(values, "contact.friction.coulomb", 1)
    assign(values, "time.step", 2)
    assert values == {"contact": {"friction": {"coulomb": 1}}, "time": {"step": 2}}


@pytest.mark.parametrize("path", ["a.b", "l.1", "l.x", "l.0.c", "l.-1"])
def test_a_path_through_a_scalar_or_beyond_a_list_is_refused(path):
    with pytest.raises(LookupError):
        assign({"a": 1, "l": [2]}, path, 3)


def test_parts_and_neighbours_of_a_path():
    """Beside what the examples of the functions say."""
    assert known_part("a.b.c", {"a", "a.b"}) == "a.b"
    assert known_part("x.y", {"a"}) == ""
    known = ["contact.friction_coefficient", "fingertip.phalanx.variant", "time.step"]
    assert nearest("time.stp", known) == "time.step"
    assert nearest("qqq", known) is None


def test_flatten_keeps_leaves_and_numbers_lists():
    nested = {"contact": {"friction_coefficient": 0.6}, "programme": [{"press": {"depth": "1 mm"}}], "none": {}}
    assert flatten(nested) == {"contact.friction_coefficient": 0.6, "programme.0.press.depth": "1 mm", "none": {}}
