"""From a model to its discrete system; models that cannot be computed are refused."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.simulation import simulate
from fingerslip.dynamics.system import build_system, check_model
from fingerslip.errors import InputError, MeshError
from fingerslip.verification.meshes import box
from problems.pushed import pad, push_and_slide


def contact(**changes):
    return (fs.Contact(**({"boundary": "bottom", "friction": fs.Coulomb(0.4)} | changes)),)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"contacts": contact(boundary="pulp")}, "boundary 'pulp' not in mesh, it has: bottom, left, right, top"),
        ({"supports": {"nail": ("x",)}}, "boundary 'nail' not in mesh"),
        ({"supports": {"top": ("z",)}}, "supports.top: got component 'z', needs x or y"),
        ({"supports": {"bulk": ("x", "y")}}, "supports: fix every degree of freedom"),
        ({"tractions": {"left": (1.0,)}}, "tractions.left: got 1 components, needs 2"),
        ({"materials": {}}, "region 'bulk' has no material"),
        (
            {"contacts": contact(counterface=fs.Plane(offset=1e-3))},
            "contacts.0.offset: the plate starts 1 mm inside the body",
        ),
        (
            {"contacts": contact(counterface=fs.Plane(offset=-1.0))},
            "no node of the boundary is within 0.6 mm of the plate",
        ),
        (
            {"contacts": contact(counterface=fs.Plane(normal=(0, 0, 1)))},
            "contacts.0.counterface.normal: got 3 components, needs 2",
        ),
        (
            {"programme": (fs.Press(4.5e-3, 1e-3),)},
            "programme: presses 4.5 mm deep, needs less than the 4 mm between the contact and what the supports hold",
        ),
        (
            {"contacts": contact(programme=(fs.Press(2e-3, 1e-3), fs.Lift(1e-3, 1e-3), fs.Press(3e-3, 1e-3)))},
            "contacts.0.programme: presses 4 mm deep",
        ),
        ({"programme": (fs.Slide(1e-3, 1e-3), fs.Press(1e-3, 1e-3))}, "slides before the plate touches"),
        ({"programme": (fs.Press(1e-3, 1e-3), fs.Slide(1e-3, 1e-3, (0.0, 1.0)))}, "needs a direction along the plate"),
        ({"record": fs.Recording(sites=(fs.Site("far", "", (1.0, 1.0)),))}, "site far: x = 1000 mm"),
        ({"record": fs.Recording(sites=(fs.Site("a", "", (0.0, 0.0), "nail"),))}, "region 'nail' is not in the mesh"),
    ],
)
def test_models_that_cannot_be_computed_are_refused_by_the_check_and_by_the_build(changes, message):
    model = push_and_slide(**changes)
    for refuse in (check_model, build_system):
        with pytest.raises(InputError) as caught:
            refuse(model)
        assert message in str(caught.value)


def test_a_press_that_strains_the_body_too_much_is_warned_of(caplog):
    check_model(push_and_slide(programme=(fs.Press(1.9e-3, 1e-3),)))
    assert not caplog.records
    check_model(push_and_slide(programme=(fs.Press(2.1e-3, 1e-3),)))
    assert "presses 2.1 mm deep, 52 % of the 4 mm" in caplog.text


def test_supports_that_let_the_body_go_along_the_normal_do_not_stop_a_press():
    check_model(push_and_slide(programme=(fs.Press(4.5e-3, 1e-3),), supports={"top": ("x",)}))


def test_what_is_held_behind_the_plate_does_not_stop_it():
    """The plate presses the top; the held bottom corner is on its other side from the start."""
    mesh = pad("Q4").with_boundaries({"foot": lambda x: x[1] < 1.1e-3})
    plate = contact(
        boundary="top", counterface=fs.Plane(normal=(0, 1), offset=3.9e-3), programme=(fs.Press(0.2e-3, 1e-3),)
    )
    check_model(push_and_slide(mesh=mesh, contacts=plate, supports={"foot": ("x", "y")}))


def test_a_body_that_is_held_along_the_normal_as_a_whole_has_no_soft_thickness():
    supports = {"bulk": ("y",), "top": ("x", "y")}
    check_model(push_and_slide(programme=(fs.Press(4.5e-3, 1e-3),), supports=supports))


def test_a_body_pressed_by_tractions_may_slide_at_once():
    pressed = push_and_slide(programme=(fs.Slide(1e-3, 1e-3),), tractions={"left": (10.0, 0.0)})
    system = build_system(pressed)
    assert len(system.candidates.nodes) == 9, "tractions may bring every node of the boundary down"


def test_regions_that_share_cells_are_refused():
    mesh = pad("Q4")
    mesh = mesh.with_subdomains({"twin": np.array([0])})
    material = fs.Elastic(34e3, 0.4, 1000.0)
    with pytest.raises(InputError, match=r"region '.*' shares cells with another, a cell has one material"):
        check_model(push_and_slide(mesh=mesh, materials={"bulk": material, "twin": material}))


def test_missing_names_are_mesh_errors():
    with pytest.raises(MeshError):
        check_model(push_and_slide(contacts=contact(boundary="pulp")))


def test_a_slide_after_a_press_that_is_too_short_is_refused():
    programme = (fs.Press(0.05e-3, 1e-3), fs.Slide(1e-3, 1e-3))
    counterface = fs.Plane(offset=-0.1e-3)
    with pytest.raises(InputError, match="deeper than the gap"):
        check_model(
            push_and_slide(programme=programme, contacts=contact(counterface=counterface, search_distance=1e-3))
        )


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


def test_candidates_are_within_one_and_a_half_times_the_way_of_the_plate():
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


@pytest.mark.parametrize("element", ["Q4", "T6"])
def test_automatic_penalties_follow_layer_and_facets(element):
    grid = np.linspace(0.0, 1e-3, 5)
    layers = {"skin": lambda c: c[1] < 0.5e-3, "core": lambda c: c[1] > 0.5e-3}
    mesh = box(element, grid, grid, regions=layers)
    materials = {"skin": fs.Elastic(2e5, 0.4, 1000.0), "core": fs.Elastic(1e6, 0.4, 1000.0)}
    candidates = build_system(push_and_slide(mesh=mesh, materials=materials)).candidates
    np.testing.assert_allclose(candidates.normal_stiffness / candidates.area, 10 * 2e5 / 0.25e-3)
    np.testing.assert_allclose(candidates.tangential_stiffness / candidates.area, 10 * 2e5 / 0.25e-3)


def test_given_penalties_are_taken():
    made = build_system(push_and_slide(contacts=contact(normal_penalty=1e7, tangential_penalty=2e6))).candidates
    np.testing.assert_allclose(made.normal_stiffness / made.area, 1e7)
    np.testing.assert_allclose(made.tangential_stiffness / made.area, 2e6)


def test_tributary_areas_are_those_of_the_boundary():
    system = build_system(push_and_slide(contacts=contact(search_distance=1.0)))
    mesh = pad("Q4")
    ends = mesh.p[:, mesh.facets[:, mesh.boundaries["bottom"]]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=0).sum()
    assert system.candidates.area.sum() == pytest.approx(1e-3 * length, rel=1e-12)


def test_automatic_penalties_are_those_of_the_stiffest_layer_and_of_a_middling_facet():
    """Two materials side by side under the boundary, and facets of three sizes."""
    xs, ys = [0.0, 1e-3, 1.5e-3, 2e-3, 2.5e-3, 4.5e-3], np.linspace(0.0, 1e-3, 3)
    halves = {"soft": lambda c: c[0] < 1.5e-3, "stiff": lambda c: c[0] > 1.5e-3}
    mesh = box("Q4", xs, ys, regions=halves)
    materials = {"soft": fs.Elastic(1e5, 0.4, 1000.0), "stiff": fs.Elastic(3e5, 0.4, 1000.0)}
    candidates = build_system(push_and_slide(mesh=mesh, materials=materials)).candidates
    np.testing.assert_allclose(candidates.normal_stiffness / candidates.area, 10 * 3e5 / 0.5e-3)
