"""Matrices of layers that relax: parts of the elastic stiffness, layer by layer."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import relaxing_layers, stiffness_matrix
from fingerslip.fe.space import build_space
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.prony import PronyTerm
from fingerslip.verification.meshes import box

SOME, OTHER = (PronyTerm(0.3, 0.1),), (PronyTerm(0.3, 0.2),)


def space_of(element):
    grid = np.linspace(0.0, 1.0, 3)
    regions = {"a": lambda c: c[0] < 0.5, "b": lambda c: c[0] > 0.5}
    return build_space(box(element, *[grid] * (3 if element in ("H8", "T4", "T10") else 2), regions=regions))


def relaxed(law, left):
    """Return the law with a part of its shear modulus left and the same bulk modulus."""
    bulk, shear = law.youngs_modulus / (3 * (1 - 2 * law.poisson_ratio)), left * law.shear_modulus
    young = 9 * bulk * shear / (3 * bulk + shear)
    return Elastic(young, young / (2 * shear) - 1, law.density)


KINDS = [("Q4", "selective"), ("T3", "nodal"), ("T6", "selective"), ("H8", "selective"), ("T4", "nodal")]


@pytest.mark.parametrize(("element", "integration"), KINDS)
def test_stiffness_less_a_share_of_the_shape_is_that_of_relaxed_moduli(element, integration):
    space, formulation = space_of(element), "solid" if element in ("H8", "T4") else "plane_strain"
    law, elastic = Elastic(34e3, 0.45, 1000.0, prony=SOME), Elastic(1e5, 0.3, 1000.0)
    materials = cell_materials(space, {"a": law, "b": elastic}, formulation)
    (layers,) = relaxing_layers(space, materials, 1.0, integration)
    assert (layers.prony, layers.thickness, layers.across) == (SOME, None, None)
    slow = cell_materials(space, {"a": relaxed(law, 0.7), "b": elastic}, formulation)
    expected = stiffness_matrix(space, slow, 1.0, integration)
    found = stiffness_matrix(space, materials, 1.0, integration) - 0.3 * layers.shape
    np.testing.assert_allclose(found.toarray(), expected.toarray(), atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("integration", ["selective", "full"])
def test_in_plane_stress_both_parts_make_the_elastic_stiffness(integration):
    space, law = space_of("Q4"), Elastic(34e3, 0.45, 1000.0, prony=SOME)
    materials = cell_materials(space, {"a": law, "b": law}, "plane_stress")
    (layers,) = relaxing_layers(space, materials, 2.0, integration)
    expected = stiffness_matrix(space, materials, 2.0, integration)
    found = layers.shape + layers.across.along * layers.thickness
    np.testing.assert_allclose(found.toarray(), expected.toarray(), atol=1e-9 * np.abs(expected).max())


def test_layers_are_joined_where_they_relax_alike():
    space = space_of("Q4")
    soft, stiff = Elastic(1e4, 0.4, 1.0, prony=SOME), Elastic(1e5, 0.3, 1.0, prony=SOME)

    def count(a, b, formulation):
        return len(relaxing_layers(space, cell_materials(space, {"a": a, "b": b}, formulation), 1.0, "selective"))

    assert count(soft, stiff, "plane_strain") == 1
    assert count(soft, stiff, "plane_stress") == 2, "the strain across is another one"
    assert count(soft, Elastic(1e5, 0.3, 1.0, prony=OTHER), "plane_strain") == 2
    assert count(Elastic(1e4, 0.4, 1.0), Elastic(1e5, 0.3, 1.0), "plane_strain") == 0


def test_layers_know_their_materials_and_take_maps():
    space, law = space_of("Q4"), Elastic(34e3, 0.45, 1000.0, prony=SOME)
    (layers,) = relaxing_layers(space, cell_materials(space, {"a": law, "b": law}, "plane_stress"), 1.0, "selective")
    assert layers.belongs_to(law)
    assert not layers.belongs_to(Elastic(34e3, 0.3, 1000.0, prony=SOME))
    assert not layers.belongs_to(Elastic(34e3, 0.45, 1000.0, prony=OTHER))
    rows = layers.apply_map(lambda matrix: matrix[:2])
    assert rows.shape.shape == rows.thickness.shape == (2, space.n_dofs)
