"""Models that cannot be computed are refused before anything is assembled."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.system.checks import check_model, inspect_model
from fingerslip.dynamics.system.system import build_system
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
            "contacts.0.offset: the counterface starts 1 mm inside the body, needs an offset <= 0 mm",
        ),
        (
            {"contacts": contact(counterface=fs.Plane(offset=-1.0))},
            "no node of the boundary is within 0.6 mm of the counterface",
        ),
        (
            {"contacts": contact(counterface=fs.Plane(normal=(0, 0, 1)))},
            "contacts.0.counterface.normal: got 3 components, needs 2",
        ),
        (
            {"contacts": contact(counterface=fs.Plane(offset=-1e-3), clearance=0.2e-3)},
            "contacts.0.clearance: got 0.2 mm for a counterface whose start is given, needs a counterface without",
        ),
        (
            {
                "contacts": contact(clearance=0.3e-3),
                "programme": (fs.Press(0.25e-3, 1e-3), fs.Slide(1e-3, 1e-3)),
            },
            "slides before the counterface touches",
        ),
        (
            {"programme": (fs.Press(4.5e-3, 1e-3),)},
            "programme: presses 4.5 mm deep, needs less than the 4 mm between the contact and what the supports hold",
        ),
        (
            {"contacts": contact(programme=(fs.Press(2e-3, 1e-3), fs.Lift(1e-3, 1e-3), fs.Press(3e-3, 1e-3)))},
            "contacts.0.programme: presses 4 mm deep",
        ),
        ({"programme": (fs.Slide(1e-3, 1e-3), fs.Press(1e-3, 1e-3))}, "slides before the counterface touches"),
        (
            {"programme": (fs.Press(1e-3, 1e-3), fs.Slide(1e-3, 1e-3, (0.0, 1.0)))},
            "needs a direction along the counterface",
        ),
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


def test_regions_that_share_cells_are_refused():
    mesh = pad("Q4")
    mesh = mesh.with_subdomains({"twin": np.array([0])})
    material = fs.Elastic(34e3, 0.4, 1000.0)
    with pytest.raises(InputError, match=r"region '.*' shares cells with another, a cell has one material"):
        check_model(push_and_slide(mesh=mesh, materials={"bulk": material, "twin": material}))


def test_missing_names_are_mesh_errors():
    with pytest.raises(MeshError):
        check_model(push_and_slide(contacts=contact(boundary="pulp")))


@pytest.mark.parametrize("element", ["T3", "T6"])
def test_a_mesh_that_folds_over_itself_is_refused(element):
    """Where its cells are of one material, and of two that meet at the fold."""
    xs, ys = np.linspace(-4e-3, 4e-3, 9), np.linspace(0.0, 4e-3, 5)

    def folded(points):
        moved = points.copy()
        moved[0, np.isclose(points, [[0.0], [2e-3]]).all(axis=0)] = 1.7e-3
        return moved

    halves = {"left": lambda x: x[0] < 0.0, "right": lambda x: x[0] > 0.0}
    tissue = fs.Elastic(34e3, 0.4, 1000.0)
    for regions in (None, halves):
        mesh = box(element, xs, ys, shift=folded, regions=regions)
        model = push_and_slide(mesh=mesh, materials=dict.fromkeys(mesh.subdomains, tissue))
        for refuse in (check_model, build_system, fs.simulate):
            with pytest.raises(MeshError, match=r"^mesh: has cells that fold over each other: .* mm .* edge; move"):
                refuse(model)


def test_a_slide_after_a_press_that_is_too_short_is_refused():
    programme = (fs.Press(0.05e-3, 1e-3), fs.Slide(1e-3, 1e-3))
    counterface = fs.Plane(offset=-0.1e-3)
    with pytest.raises(InputError, match="deeper than the gap"):
        check_model(
            push_and_slide(programme=programme, contacts=contact(counterface=counterface, search_distance=1e-3))
        )


@pytest.mark.parametrize("counterface", [fs.Plane(), fs.Cylinder(8e-3), fs.Plane(normal=(0.1, 1.0))])
def test_a_clearance_is_the_gap_along_the_normal_at_the_start(counterface):
    touching, apart = (
        inspect_model(push_and_slide(contacts=contact(counterface=counterface, clearance=clearance)))
        for clearance in (0.0, 0.35e-3)
    )
    skin = touching.space.positions[touching.candidates[0].nodes]
    assert touching.counterfaces[0].gap(skin).min() == pytest.approx(0.0, abs=1e-12)
    moved = skin + 0.35e-3 * counterface.unit_normal
    np.testing.assert_allclose(apart.counterfaces[0].gap(skin), touching.counterfaces[0].gap(moved), atol=1e-12)


def test_a_clearance_leaves_less_of_a_press():
    deep = (fs.Press(4.2e-3, 1e-3),)
    check_model(push_and_slide(programme=deep, contacts=contact(clearance=0.35e-3)))
    with pytest.raises(InputError, match=r"presses 4.1 mm deep"):
        check_model(push_and_slide(programme=deep, contacts=contact(clearance=0.1e-3)))


def test_a_body_at_large_strain_that_contact_alone_holds_is_refused():
    model = fs.Model(
        mesh=box("Q4", np.linspace(0.0, 1e-2, 3), np.linspace(0.0, 1e-2, 3)),
        materials={"bulk": fs.NeoHookean(1e5, 0.3, 1000.0)},
        formulation="plane_strain",
        supports={"left": ("x",)},
        contacts=(fs.Contact("bottom", fs.Plane((0.0, 1.0)), fs.Coulomb(0.5)),),
        gravity=(0.0, -9.81),
        time=fs.QuasiStatic(0.1, end=1.0),
    )
    check_model(model)
    with pytest.raises(InputError, match=r"supports: leave it to contact alone .*; support it, take TimeStepping, or"):
        check_model(dataclasses.replace(model, kinematics="finite"))
