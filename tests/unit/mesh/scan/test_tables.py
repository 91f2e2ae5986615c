"""What is told of the mesh of a scan, in millimetres."""

from __future__ import annotations

import pytest

from fingerslip.mesh.scan.build import scan_tables
from unit.scans import mesh_of_a_scan


def test_tables_are_in_millimetres() -> None:
    quality, distances, repairs = scan_tables(mesh_of_a_scan())
    (row,) = quality.rows
    assert row[:3] == ("tissue", 5, pytest.approx(1000.0))
    assert "8 nodes, 5 cells; boundaries: skin" in quality.note
    assert distances.rows == (("skin", pytest.approx(0.02), pytest.approx(0.07)),)
    assert "0.9 to 1.1 mm, mean 1 mm" in distances.note
    assert repairs.rows == (("skin.stl", 1, 94, 1, 1, pytest.approx(15.6)),)
    for table in (quality, distances, repairs):
        assert {len(row) for row in table.rows} == {len(table.columns)}
