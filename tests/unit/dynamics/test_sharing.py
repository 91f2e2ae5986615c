"""Which models share a matrix: those that differ in friction, programme and loads alone."""

from __future__ import annotations

import dataclasses

import pytest

import fingerslip as fs
from fingerslip.dynamics.sharing import check_same_matrix, same_matrix
from problems.pushed import push_and_slide

CONTACT = fs.Contact("bottom", friction=fs.Coulomb(0.4))


def contact(**changes):
    return (dataclasses.replace(CONTACT, **changes),)


@pytest.mark.parametrize(
    "change",
    [
        {"contacts": contact(friction=fs.Coulomb(0.9))},
        {"contacts": contact(programme=(fs.Press(1e-4, 1e-3),))},
        {"contacts": contact(search_distance=1e-3)},
        {"programme": (fs.Press(2e-4, 1e-3), fs.Slide(1e-3, 2e-3, (-1.0, 0.0)))},
        {"gravity": (0.0, -9.81)},
        {"record": fs.Recording(snapshots_every=0.01)},
    ],
)
def test_friction_programme_loads_and_records_may_differ(change):
    one, other = (push_and_slide(**({"contacts": (CONTACT,)} | more)) for more in ({}, change))
    assert same_matrix(one, other)
    check_same_matrix([one, other])


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"materials": {"block": fs.Elastic(1.0e4, 0.3, 1000.0)}}, "materials"),
        ({"depth": 2e-3}, "depth"),
        ({"supports": {"top": ("y",)}}, "supports"),
        ({"damping": fs.RayleighDamping(mass=1.0)}, "damping"),
        ({"integration": "full"}, "integration"),
        ({"time": fs.TimeStepping(1e-3)}, "time"),
        ({"time": fs.QuasiStatic(5e-3)}, "time"),
        ({"contacts": ()}, "contacts"),
        ({"contacts": contact(normal_penalty=1e7)}, "contacts.0"),
        ({"contacts": contact(counterface=fs.Cylinder(0.01))}, "contacts.0"),
    ],
)
def test_what_changes_the_matrix_is_refused(change, part):
    one = push_and_slide(contacts=(CONTACT,))
    other = dataclasses.replace(one, **change)
    assert not same_matrix(one, other)
    with pytest.raises(fs.InputError, match=rf"models\.1\.{part}: differs .* simulate it by itself"):
        check_same_matrix([one, other])


def test_meshes_are_the_same_where_their_nodes_and_names_are():
    one = push_and_slide()
    copied = type(one.mesh)(one.mesh.p.copy(), one.mesh.t.copy(), one.mesh.boundaries, one.mesh.subdomains)
    copied = copied.with_boundaries(one.mesh.boundaries).with_subdomains(one.mesh.subdomains)
    moved = one.mesh.translated((1e-6, 0.0)).with_boundaries(one.mesh.boundaries)
    assert same_matrix(one, dataclasses.replace(one, mesh=copied))
    assert not same_matrix(one, dataclasses.replace(one, mesh=moved.with_subdomains(one.mesh.subdomains)))


def test_no_models_are_refused():
    with pytest.raises(fs.InputError, match="models: got none"):
        check_same_matrix([])
