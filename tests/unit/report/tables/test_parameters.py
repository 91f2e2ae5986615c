"""Tables of values with their sources, of what was run and of models as computed."""

import pytest
import xarray as xr

from fingerslip.report.tables.parameters import (
    GROUPS,
    ShownValue,
    conditions_table,
    group_of,
    models_table,
    value_tables,
)
from fingerslip.tables.table import texts, to_markdown
from unit.report.scenes import block_history
from unit.synthetic import Process, make

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
def test_every_value_has_its_group(path, group):
    assert group_of(path) == group


def test_assumed_values_come_first_and_are_marked_and_unused_ones_come_last():
    tables = value_tables(VALUES)
    specimen, time = tables
    assert [specimen.title, time.title] == [title for title in GROUPS if title in ("Specimen", "Time")]
    assert sorted(str(row[0]) for table in tables for row in table.rows) == sorted(value.path for value in VALUES)
    assert [row[2] for row in specimen.rows] == ["assumed", "wang2014", "not used"]
    assert specimen.marked == (0,)
    assert specimen.note.startswith("1 of 3 values are assumed")
    assert (time.marked, time.note) == ((), "")
    assert "| time.step | 5 ms | study file |" in to_markdown(time)


CONDITIONS = (
    ShownValue("time.step", "5 ms", "study file"),
    ShownValue("fingertip.preset", "wang2014-2d", "study file"),
    ShownValue("fingertip.depth", "1 mm", "assumed", "scales all forces"),
    ShownValue("fingertip.materials.dermis.youngs_modulus", "80 kPa", "wang2014"),
    ShownValue("fingertip.layers.skin_thickness", "1.5 mm", "wang2014"),
    ShownValue("fingertip.ridges.pitch", "0.5 mm", "study file", "preset: 0.47 mm"),
    ShownValue("programme.0.press.depth", "1.5 mm", "study file"),
    ShownValue("fingertip.transverse.half_width", "8 mm", "not used"),
    ShownValue("record.receptors", "FA-I", "study file"),
)


def test_conditions_stand_in_one_order_with_overrides_and_marked_assumptions():
    histories = {name: xr.Dataset(attrs={"n_nodes": count}) for name, count in (("a", 10), ("b", 20))}
    table = conditions_table(CONDITIONS, histories)
    assert [row[:2] for row in table.rows] == [
        ("specimen, preset", "wang2014-2d"),
        ("depth out of the plane", "1 mm"),
        ("dermis: youngs modulus", "80 kPa"),
        ("press: depth", "1.5 mm"),
        ("time: step", "5 ms"),
        ("fingertip.ridges.pitch", "0.5 mm"),
        ("mesh: nodes", "10 to 20"),
    ]
    assert table.marked == (1,)
    assert "Assumed" in table.note


def test_sizes_contact_stiffness_and_solver_are_those_of_the_history():
    history = block_history("Q4")
    table = models_table({"one": history, "bare": make(Process())})
    rows = {row[0]: row[1:] for row in texts(table)}
    assert rows["element"] == ["Q4", "n/r"]
    assert rows["nodes"][0] == str(history.sizes["node"])
    assert rows["contact candidates"][0] == str(history.sizes["contact_node"])
    assert rows["mean normal penalty [Pa/m]"][0] == f"{history.attrs['normal_penalty']:.3g}"
    assert rows["linear solver"][0] == history.attrs["linear_solver"]
    assert models_table({"bare": make(Process())}).rows == ()
