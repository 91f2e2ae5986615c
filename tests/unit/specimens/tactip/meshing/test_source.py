"""Meshes of a TacTip as sources."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.specimens.tactip.meshing.source import SensorSectionSizes, SensorSolidSizes
from fingerslip.specimens.tactip.tactip import PRESETS


def test_a_section_is_no_solid():
    with pytest.raises(InputError, match=r"part: got section with mesh.element T4"):
        SensorSolidSizes().build(PRESETS.read("tactip-ridged-2d"))
    with pytest.raises(InputError, match=r"part: got half with mesh.element Q4"):
        SensorSectionSizes().build(PRESETS.read("tactip-ridged-3d"))


def test_refinement_scales_both_sizes():
    finer = SensorSectionSizes().refined(0.5)
    assert (finer.contact_size, finer.bulk_size) == (0.15e-3, 0.6e-3)
