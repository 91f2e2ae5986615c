"""The fingertip in 3D as a source of meshes."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip.meshing.solid.source import SolidSizes
from fingerslip.study.definition.spec import read_study
from places import STUDIES
from unit.fingers import change_solid, coarse_solid


def test_elements_in_space_do_not_lock_by_default_and_sizes_are_in_order():
    assert SolidSizes() == SolidSizes("T10", 0.8e-3, 1.3e-3, 1.5e-3)
    assert read_study(STUDIES / "wang2014_3d.yaml").mesh == SolidSizes(), "the shipped run has the defaults"
    with pytest.raises(InputError, match=r"bulk_size: got 0.2 mm, needs >= 0.8 mm"):
        SolidSizes(bulk_size=0.2e-3)
    with pytest.raises(InputError, match="element"):
        SolidSizes(element="T6")


def test_it_says_what_it_is():
    sizes = SolidSizes()
    assert (sizes.dim, sizes.element, sizes.needs_specimen, sizes.assumes_metres) == (3, "T10", True, False)
    assert sizes.refined(2.0) == SolidSizes("T10", 1.6e-3, 2.6e-3, 1.5e-3)


def test_number_of_tetrahedra_is_foreseen():
    """Coarse meshes have more than fill the body, because layers and contact are finer."""
    fingertip, sizes = change_solid(), SolidSizes("T4", 0.8e-3, 1.6e-3)
    assert 0.2 * coarse_solid().t.shape[1] < sizes.estimated_cells(fingertip) < coarse_solid().t.shape[1]
