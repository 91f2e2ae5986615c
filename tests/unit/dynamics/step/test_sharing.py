"""What may be shared: matrices, compliances and motions."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.step import sharing
from fingerslip.dynamics.step.sharing import (
    check_same_matrix,
    first_alike,
    groups_to_share,
    same_compliance,
    same_matrix,
    same_motion,
)
from fingerslip.dynamics.system.system import build_system
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


def systems(*changes):
    return [build_system(push_and_slide(**change)) for change in changes]


def test_a_compliance_is_shared_by_systems_with_the_same_candidates_in_the_same_frames():
    usual, rough, shallow, turned = systems(
        {"contacts": contact()},
        {"contacts": contact(friction=fs.Coulomb(0.9))},
        {"contacts": contact(programme=(fs.Press(2e-4, 4e-3),))},
        {"contacts": contact(counterface=fs.Plane((0.1, 1.0)))},
    )
    assert same_compliance(usual, rough)
    assert not same_compliance(usual, shallow), "it has fewer candidates"
    assert not same_compliance(usual, turned), "its frames are turned"


def test_frames_that_turn_are_none_of_the_compliances_own():
    balls = systems(*({"contacts": contact(counterface=fs.Cylinder(radius))} for radius in (0.02, 0.0201)))
    assert np.array_equal(balls[0].candidates.nodes, balls[1].candidates.nodes)
    assert same_compliance(*balls)
    assert not same_motion(*balls)


@pytest.mark.parametrize(
    ("change", "same"),
    [
        ({}, True),
        ({"programme": (fs.Press(0.4e-3, 4e-3), fs.Slide(1e-3, 2e-3, (-1.0, 0.0)))}, True),
        ({"record": fs.Recording(snapshots_every=0.01)}, True),
        ({"contacts": contact(friction=fs.Coulomb(0.9))}, False),
        ({"contacts": contact(programme=(fs.Press(2e-4, 4e-3),))}, False),
        ({"gravity": (0.0, -9.81)}, False),
        ({"tractions": {"left": (1.0, 0.0)}}, False),
        ({"initial_velocity": (1e-3, 0.0)}, False),
    ],
)
def test_motions_are_the_same_while_their_counterfaces_move_alike(change, same):
    one, other = systems({"contacts": (CONTACT,)}, {"contacts": (CONTACT,)} | change)
    assert same_motion(one, other) == same


def test_the_first_that_is_the_same_stands_for_the_others():
    assert first_alike([], lambda *_: True) == []
    assert first_alike([3, 4, 13, 5, 24, 15], lambda a, b: a % 10 == b % 10) == [0, 1, 0, 3, 1, 3]


@pytest.mark.parametrize(
    ("kinds", "groups"),
    [("aabab", [[0, 1, 3], [2, 4]]), ("a" * 10, [[0, 1, 2, 3, 4], [5, 6, 7, 8, 9]]), ("a" * 8, [list(range(8))])],
)
def test_large_models_with_one_matrix_are_grouped_evenly(kinds, groups, monkeypatch):
    monkeypatch.setattr(sharing, "_WORTH_SHARING", {2: 0, 3: 0})
    depths = {"a": 1e-3, "b": 2e-3}
    assert groups_to_share([push_and_slide(depth=depths[kind]) for kind in kinds]) == groups


@pytest.mark.parametrize(("count", "at_once", "sizes"), [(4, 2, [2, 2]), (18, 2, [5, 5, 5, 3]), (3, 8, [1, 1, 1])])
def test_in_the_plane_there_are_as_many_groups_as_can_be_simulated_at_once(count, at_once, sizes, monkeypatch):
    monkeypatch.setattr(sharing, "_WORTH_SHARING", {2: 0, 3: 0})
    model = push_and_slide()
    assert [len(group) for group in groups_to_share([model] * count, at_once)] == sizes


def test_matrices_of_their_own_make_groups_enough(monkeypatch):
    monkeypatch.setattr(sharing, "_WORTH_SHARING", {2: 0, 3: 0})
    one, other = push_and_slide(depth=1e-3), push_and_slide(depth=2e-3)
    assert groups_to_share([one, one, other, other], 2) == [[0, 1], [2, 3]]


def test_in_space_a_group_stays_together(monkeypatch):
    monkeypatch.setattr(sharing, "_WORTH_SHARING", {2: 0, 3: 0})
    monkeypatch.setattr(sharing, "_is_plane", lambda _: False)
    model = push_and_slide()
    assert groups_to_share([model] * 4, 2) == [[0, 1, 2, 3]]


def test_models_with_steps_of_their_own_stay_apart(monkeypatch):
    monkeypatch.setattr(sharing, "_WORTH_SHARING", {2: 0, 3: 0})
    model = push_and_slide(time=fs.Adaptive(5e-3))
    assert groups_to_share([model, model]) == [[0], [1]]


def test_small_models_stay_apart():
    model = push_and_slide()
    assert groups_to_share([model, model]) == [[0], [1]]
