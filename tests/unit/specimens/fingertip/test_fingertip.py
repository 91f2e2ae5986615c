"""The fingertip as a specimen: what a model takes from it."""

from __future__ import annotations

import dataclasses

import pytest

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.specimens.fingertip.fingertip import Fingertip
from fingerslip.specimens.fingertip.sites import receptor_sites, reference_sites, solid_receptor_sites
from unit.fingers import change, change_solid


def test_it_is_meshed_in_sections_and_in_space():
    assert Fingertip.mesh_sources == (fs.MeshSizes, fs.SolidSizes)
    assert change().default_mesh == fs.MeshSizes()
    assert change_solid().default_mesh == fs.SolidSizes()


def test_materials_and_receptors_change_no_mesh():
    softer = {"materials": {"tissue": {"youngs_modulus": "20 kPa"}}}
    deeper = {"receptors": {"fa_ii_depth": "4 mm"}}
    assert change(**softer).shape == change(**deeper).shape == change().shape
    assert change(**softer) != change()


@pytest.mark.parametrize(
    "groups",
    [
        {"phalanx": {"variant": "scaled"}},
        {"layers": {"skin_thickness": "1.4 mm"}},
        {"section": "transverse"},
        {"ridges": {"enabled": False}},
    ],
)
def test_other_values_do(groups):
    assert change(**groups).shape != change().shape
    assert fs.MeshSizes().key(change(**groups)) != fs.MeshSizes().key(change())


@pytest.mark.parametrize("dim", [2, 3])
def test_a_rigid_phalanx_is_held_as_a_whole_and_an_elastic_one_at_its_back(dim):
    axes = ("x", "y", "z")[:dim]
    assert change(phalanx={"rigid": True}).supports(dim) == {"phalanx": axes}
    assert change(phalanx={"rigid": False}).supports(dim) == {"phalanx_dorsal": axes}


def test_only_the_receptors_asked_for_are_sites():
    finger, solid = change(), change_solid()
    assert finger.sites((), 2) == ()
    assert finger.sites(RECEPTOR_KINDS, 2) == receptor_sites(finger)
    assert {site.kind for site in finger.sites(("FA-II", "SA-I"), 2)} == {"SA-I", "FA-II"}
    assert solid.sites(("FA-I",), 3) == tuple(s for s in solid_receptor_sites(solid) if s.kind == "FA-I")


def test_reference_nodes_are_sites_in_space_and_come_after_the_receptors():
    finger = change_solid()
    assert finger.sites(("reference_nodes",), 3) == reference_sites(finger)
    both = finger.sites(("FA-I", "reference_nodes"), 3)
    assert [site.kind == "FA-I" for site in both] == sorted((site.kind == "FA-I" for site in both), reverse=True)
    with pytest.raises(InputError, match=r"record.reference_nodes: without a fingertip in 3D, .* T4 or T10"):
        finger.sites(("reference_nodes",), 2)


def test_groups_that_it_does_not_have_are_refused():
    with pytest.raises(
        InputError, match=r"a fingertip has no 'whisker', needs some of FA-I, .*, reference_nodes, external_markers"
    ):
        change().sites(("FA-I", "whisker"), 2)


def test_changed_numbers_are_still_a_specimen():
    finger = dataclasses.replace(change(), depth=2e-3)
    assert type(finger) is Fingertip
    assert finger.depth == 2e-3
