"""Tables of values with their sources."""

from __future__ import annotations

import pytest

from fingerslip.report.tables.parameters import GROUPS, ShownValue, group_of, value_tables
from fingerslip.tables.table import to_markdown

VALUES = (
    ShownValue("fingertip.depth", "1 mm", "not used", "of 2D sections only"),
    ShownValue("fingertip.layers.skin_thickness", "1.5 mm", "wang2014"),
    ShownValue("fingertip.sagittal.half_height", "6.5 mm", "assumed", "half the height of an adult index fingertip"),
    ShownValue("time.step", "5 ms", "study file"),
)


@pytest.mark.parametrize(
    ("path", "group"),
    [
        ("fingertip.materials.dermis.density", "Materials and damping"),
        ("materials.block.density", "Materials and damping"),
        ("fingertip.layers.skin_thickness", "Specimen"),
        ("mesh.contact_size", "Mesh and formulation"),
        ("depth", "Mesh and formulation"),
        ("contacts.0.friction.coulomb.coefficient", "Contact and friction"),
        ("programme.1.slide.speed", "Programme"),
        ("supports.top", "Supports and loads"),
        ("time.alpha", "Time"),
        ("record.sites.0.name", "Recording"),
        ("something.new", "Other values"),
        ("timetable", "Other values"),
    ],
)
def test_every_value_has_its_group(path: str, group: str) -> None:
    assert group_of(path) == group


def test_assumed_values_come_first_and_are_marked_and_unused_ones_come_last() -> None:
    specimen, time = value_tables(VALUES)
    assert (specimen.title, time.title) == ("Specimen", "Time")
    assert [row[2] for row in specimen.rows] == ["assumed", "wang2014", "not used"]
    assert specimen.marked == (0,)
    assert specimen.note.startswith("1 of 3 values are assumed")
    assert (time.marked, time.note) == ((), "")
    assert "| time.step | 5 ms | study file |" in to_markdown(time)


def test_no_value_is_lost_and_groups_keep_their_order() -> None:
    tables = value_tables(VALUES)
    assert sorted(str(row[0]) for table in tables for row in table.rows) == sorted(value.path for value in VALUES)
    titles = [table.title for table in tables]
    assert titles == sorted(titles, key=list(GROUPS).index)
