"""What was run, as one table."""

from __future__ import annotations

import xarray as xr

from fingerslip.report.tables.parameters import ShownValue, conditions_table

VALUES = (
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


def test_conditions_stand_in_one_order_with_overrides_and_marked_assumptions() -> None:
    histories = {name: xr.Dataset(attrs={"n_nodes": count}) for name, count in (("a", 10), ("b", 20))}
    table = conditions_table(VALUES, histories)
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
