"""The scan that is shipped goes through the whole chain, from dirty files to the times of slip."""

from __future__ import annotations

import contextlib
import re
from typing import Any

import pytest

from places import ROOT
from unit.scans import SCAN

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def example() -> dict[str, Any]:
    """What the example of the page leaves, run as it is printed."""
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "surfaces.md").read_text(encoding="utf-8"), re.DOTALL)
    names: dict[str, Any] = {}
    before = set(ROOT.iterdir())
    with contextlib.chdir(ROOT):
        exec(compile(code, "surfaces.md", "exec"), names)
    names["left_behind"] = set(ROOT.iterdir()) - before
    return names


@pytest.fixture(scope="module")
def scan(example):
    return example["scan"]


def test_meshing_leaves_no_files_behind(example):
    assert not example["left_behind"]


def test_repairs_are_reported(scan):
    skin, phalanx = scan.repairs.values()
    assert len(skin.closed_holes) == len(skin.open_holes) == len(phalanx.open_holes) == 1
    assert skin.turned_triangles > 50
    assert phalanx.turned_triangles == 0


def test_mesh_keeps_to_the_scan(scan):
    assert [deviation.boundary for deviation in scan.deviations] == ["skin", "phalanx_surface"]
    for found in scan.deviations:
        # Off by the tolerance, and by the decimation that goes before, at most.
        assert 0 < found.mean < 0.5 * SCAN.layers.tolerance
        assert found.largest < 2 * SCAN.layers.tolerance
    least, mean, largest = scan.thickness
    assert mean == pytest.approx(1e-3, rel=0.03)
    assert 1e-3 - 2 * SCAN.layers.tolerance < least < largest < 1e-3 + 2 * SCAN.layers.tolerance


def test_cells_are_well_shaped(scan):
    assert [layer.region for layer in scan.layers] == ["skin", "tissue", "phalanx"]
    assert min(layer.least_radius_ratio for layer in scan.layers) > 0.02
    assert min(layer.mean_radius_ratio for layer in scan.layers) > 0.6
    assert max(layer.longest_edge for layer in scan.layers) < 2 * SCAN.layers.bulk_size


def test_scan_slips(example):
    events = example["events"]
    # The slide begins at 0.2 s; the edge lets go first, the whole pad before the end.
    assert 0.2 < events.incipient < events.three_quarter < events.overall < 1.0
