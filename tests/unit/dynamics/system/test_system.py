"""From a model to its discrete system."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.simulation import simulate
from fingerslip.dynamics.system.system import build_system
from fingerslip.verification.meshes import box
from problems.pushed import pad, push_and_slide


def contact(**changes):
    return (fs.Contact(**({"boundary": "bottom", "friction": fs.Coulomb(0.4)} | changes)),)


def test_a_body_pressed_by_tractions_may_slide_at_once():
    pressed = push_and_slide(programme=(fs.Slide(1e-3, 1e-3),), tractions={"left": (10.0, 0.0)})
    system = build_system(pressed)
    assert len(system.candidates.nodes) == 9, "tractions may bring every node of the boundary down"


def test_supports_take_boundaries_and_whole_regions():
    boundary = build_system(push_and_slide(supports={"top": ("y",)}))
    nodes = boundary.space.positions.shape[0]
    assert len(boundary.free) == 2 * nodes - 9
    region = build_system(push_and_slide(supports={"bulk": ("y",), "top": ("x", "y")}))
    assert len(region.free) == nodes - 9
    assert (region.free % 2 == 0).all()


def test_matrices_are_those_of_the_free_degrees_of_freedom():
    system = build_system(push_and_slide())
    count = len(system.free)
    assert system.stiffness.shape == system.mass.shape == (count, count)
    assert np.linalg.eigvalsh(system.stiffness.toarray()).min() > 0.0
    assert system.relative.shape == (2 * len(system.candidates.nodes), count)


def test_candidates_are_within_one_and_a_half_times_the_approach_of_the_plate():
    system = build_system(push_and_slide())
    gaps = system.counterfaces.gaps(system.candidates.positions, system.candidates.counterface)
    assert gaps.max() <= 1.5 * 0.4e-3
    positions, outside = system.space.positions, system.outsiders[0].nodes
    assert len(outside) + len(system.candidates.nodes) == 9
    assert (positions[outside, 1] - positions[:, 1].min() > 1.5 * 0.4e-3).all()


def test_corners_of_quadratic_tetrahedra_may_follow_their_neighbours_into_the_plate():
    """They have no tributary area, so that no penalty holds them back: they are neither candidates nor outsiders."""
    axes = [np.linspace(0.0, 1.0, 2)] * 3
    plate = fs.Contact(
        boundary="bottom", counterface=fs.Plane((0.0, 0.0, 1.0)), friction=fs.Coulomb(0.5), search_distance=1.0
    )
    model = fs.Model(
        mesh=box("T10", *axes),
        materials={"bulk": fs.Elastic(1e5, 0.3, 1000.0)},
        formulation="solid",
        supports={"top": ("x", "y", "z")},
        contacts=(plate,),
        programme=(fs.Press(0.01, 0.01),),
        time=fs.QuasiStatic(0.5),
    )
    system = build_system(model)
    assert len(system.candidates.nodes) == 5, "the mid-side nodes of two triangles"
    assert system.outsiders[0].nodes.size == 0
    assert simulate(model)["counterface_force"].values[-1, 0, 2] > 0.0


def test_tributary_areas_are_those_of_the_boundary():
    system = build_system(push_and_slide(contacts=contact(search_distance=1.0)))
    mesh = pad("Q4")
    ends = mesh.p[:, mesh.facets[:, mesh.boundaries["bottom"]]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=0).sum()
    assert system.candidates.area.sum() == pytest.approx(1e-3 * length, rel=1e-12)
