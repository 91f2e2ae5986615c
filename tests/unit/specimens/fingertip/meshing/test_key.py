"""The hash of a fingertip's mesh: all that decides it, and nothing else."""

from __future__ import annotations

import pytest

from fingerslip.specimens.fingertip.meshing.key import mesh_key
from fingerslip.specimens.fingertip.meshing.section.source import MeshSizes
from unit.fingers import change

SOFTER = {"tissue": {"youngs_modulus": "20 kPa"}}


@pytest.mark.parametrize("groups", [{"materials": SOFTER}, {"receptors": {"fa_ii_depth": "4 mm"}}])
def test_materials_and_receptors_change_no_mesh(groups):
    assert mesh_key(change(**groups), MeshSizes()) == mesh_key(change(), MeshSizes())


@pytest.mark.parametrize(
    "groups",
    [
        {"phalanx": {"variant": "scaled"}},
        {"layers": {"skin_thickness": "1.4 mm"}},
        {"section": "transverse"},
        {"ridges": {"enabled": False}},
    ],
)
def test_the_shape_does(groups):
    assert mesh_key(change(**groups), MeshSizes()) != mesh_key(change(), MeshSizes())


def test_the_sizes_do():
    assert mesh_key(change(), MeshSizes(element="T3")) != mesh_key(change(), MeshSizes())
