"""Presets of any specimen: values with sources, and changes to them."""

from __future__ import annotations

from importlib import resources

import pytest

from fingerslip.errors import InputError
from fingerslip.parameters import Density, PositiveLength, parameters
from fingerslip.parameters.presets import Presets, PresetValue

DOCUMENT = """
citation: >-
  Someone: A block.
  Journal, 2020.
claims_not: anything
values:
  size.width: {value: 10 mm, source: someone2020, note: measured}
  size.height: {value: 5 mm, source: assumed}
  density: {value: 1000 kg/m^3, source: someone2020, note: of water}
  soft: {value: true, source: assumed}
"""


@parameters
class Size:
    """Width and height of a block."""

    width: PositiveLength
    height: PositiveLength


@parameters
class Block:
    """A block."""

    size: Size
    density: Density
    soft: bool


@pytest.fixture
def presets(tmp_path, monkeypatch):
    (tmp_path / "presets").mkdir()
    (tmp_path / "presets" / "someone2020.yaml").write_text(DOCUMENT)
    (tmp_path / "presets" / "notes.txt").write_text("")
    monkeypatch.setattr(resources, "files", lambda _: tmp_path)
    return Presets(Block, str(tmp_path))


def test_presets_are_named_read_and_listed_with_the_assumed_values_first(presets):
    assert presets.names == ("someone2020",)
    assert presets.read("someone2020") == Block(Size(10e-3, 5e-3), 1000.0, True)
    table = presets.table("someone2020")
    assert table[0] == PresetValue("size.height", "5 mm", "assumed", "")
    assert [row.path for row in table] == ["size.height", "soft", "size.width", "density"]
    assert table[1].value == "true"
    header = presets.header("someone2020")
    assert header == {"citation": "Someone: A block. Journal, 2020.", "claims_not": "anything"}


def test_changes_merge_deeply(presets):
    changed = presets.changed({"preset": "someone2020", "size": {"height": "6 mm"}}, "x.yaml: block")
    assert changed.size == Size(10e-3, 6e-3)


def test_ranges_stand_with_the_notes(presets, tmp_path):
    text = "citation: a\nvalues:\n  density: {value: 1 kg/m^3, source: assumed, note: of air, range: 1 to 2 kg/m^3}\n"
    (tmp_path / "presets" / "air.yaml").write_text(text)
    assert presets.table("air")[0].note == "of air; range 1 to 2 kg/m^3"


def test_what_changes_leave_of_a_group_may_be_chosen(presets):
    choosy = Presets(Block, presets.package, lambda group, _: {"width": group["width"]} if "width" in group else group)
    with pytest.raises(InputError, match=r"size\.height: is missing"):
        choosy.changed({"preset": "someone2020", "size": {"width": "1 mm"}})


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ({}, "x.yaml: block.preset: is missing, needs one of someone2020"),
        ({"preset": "someone2021"}, "x.yaml: block.preset: 'someone2021' is not known.*did you mean 'someone2020'"),
        ({"preset": "someone2020", "size": {"hight": "1 mm"}}, "x.yaml: block.size.hight: .*did you mean 'height'"),
    ],
)
def test_wrong_changes_are_named(presets, mapping, message):
    with pytest.raises(InputError, match=message):
        presets.changed(mapping, "x.yaml: block")


@pytest.mark.parametrize("ask", ["read", "table", "header"])
def test_unknown_names_are_refused(presets, ask):
    with pytest.raises(InputError, match="preset: 'nobody' is not known, needs one of someone2020"):
        getattr(presets, ask)("nobody")
