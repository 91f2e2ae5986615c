"""Models that cannot be computed are refused before anything is assembled, and what is doubtful is said."""

from __future__ import annotations

import dataclasses
import logging

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.system.checks import check_model, inspect_model
from fingerslip.dynamics.system.doubts import doubts
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
        (
            {
                "programme": (fs.Press(0.05e-3, 1e-3), fs.Slide(1e-3, 1e-3)),
                "contacts": contact(counterface=fs.Plane(offset=-0.1e-3), search_distance=1e-3),
            },
            "deeper than the gap",
        ),
        (
            {"programme": (fs.Press(4.2e-3, 1e-3),), "contacts": contact(clearance=0.1e-3)},
            "presses 4.1 mm deep",
        ),
        (
            {
                "mesh": pad("Q4").with_subdomains({"twin": np.array([0])}),
                "materials": dict.fromkeys(("bulk", "twin"), fs.Elastic(34e3, 0.4, 1000.0)),
            },
            "shares cells with another, a cell has one material",
        ),
        ({"record": fs.Recording(sites=(fs.Site("far", "", (1.0, 1.0)),))}, "site far: x = 1000 mm"),
        ({"record": fs.Recording(sites=(fs.Site("a", "", (0.0, 0.0), "nail"),))}, "region 'nail' is not in the mesh"),
    ],
)
def test_models_that_cannot_be_computed_are_refused_by_the_check_and_by_the_simulation(changes, message):
    model = push_and_slide(**changes)
    for refuse in (check_model, fs.simulate):
        with pytest.raises(InputError) as caught:
            refuse(model)
        assert message in str(caught.value)
        assert isinstance(caught.value, MeshError) == ("not in mesh" in message)


def test_a_press_that_strains_the_body_too_much_is_warned_of(caplog):
    check_model(push_and_slide(programme=(fs.Press(1.9e-3, 1e-3),)))
    assert not caplog.records
    check_model(push_and_slide(programme=(fs.Press(2.1e-3, 1e-3),)))
    assert "presses 2.1 mm deep, 52 % of the 4 mm" in caplog.text


@pytest.mark.parametrize(
    "changes",
    [
        {"programme": (fs.Press(4.5e-3, 1e-3),), "supports": {"top": ("x",)}},
        {"programme": (fs.Press(4.5e-3, 1e-3),), "supports": {"bulk": ("y",), "top": ("x", "y")}},
        {"programme": (fs.Press(4.2e-3, 1e-3),), "contacts": contact(clearance=0.35e-3)},
        {
            "mesh": pad("Q4").with_boundaries({"foot": lambda x: x[1] < 1.1e-3}),
            "contacts": contact(
                boundary="top", counterface=fs.Plane(normal=(0, 1), offset=3.9e-3), programme=(fs.Press(0.2e-3, 1e-3),)
            ),
            "supports": {"foot": ("x", "y")},
        },
    ],
    ids=["free along the normal", "held as a whole", "clearance", "held behind the plate"],
)
def test_a_press_goes_as_deep_as_what_the_supports_hold_lets_it(changes):
    check_model(push_and_slide(**changes))


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
        for refuse in (check_model, fs.simulate):
            with pytest.raises(MeshError, match=r"^mesh: has cells that fold over each other: .* mm .* edge; move"):
                refuse(model)


@pytest.mark.parametrize("counterface", [fs.Plane(), fs.Cylinder(8e-3), fs.Plane(normal=(0.1, 1.0))])
def test_a_clearance_is_the_gap_along_the_normal_at_the_start(counterface):
    still = {"programme": (), "time": fs.QuasiStatic(0.1, end=0.1)}
    touching, apart = (
        fs.simulate(
            push_and_slide(contacts=contact(counterface=counterface, clearance=way, search_distance=1.0), **still)
        )
        for way in (0.0, 0.35e-3)
    )
    placed = counterface.at_start(touching.contact_position.values)
    assert float(touching.gap[0].min()) == pytest.approx(0.0, abs=1e-12)
    moved = placed.gap(touching.contact_position.values + 0.35e-3 * counterface.unit_normal)
    np.testing.assert_allclose(apart.gap[0], moved, atol=1e-12)


def test_boundaries_and_whole_regions_are_supported():
    """Here the latter along y, so that the body shears as a whole."""
    still = {"programme": (), "contacts": (), "time": fs.QuasiStatic(0.1, end=0.1)}
    for supports, free in (
        ({"top": ("y",), "left": ("x",)}, 90 - 9 - 5),
        ({"bulk": ("y",), "top": ("x", "y")}, 45 - 9),
    ):
        assert fs.simulate(push_and_slide(**still, supports=supports)).attrs["n_degrees_of_freedom"] == free


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


# Doubts: what is hardly meant in models that can be computed.

PLATE = fs.Contact("bottom", fs.Plane(normal=(0, 1)), fs.Coulomb(0.5))
MODEL = fs.Model(
    mesh=box("Q4", np.linspace(0.0, 10e-3, 21), np.linspace(0.0, 4e-3, 5)),
    materials={"bulk": fs.Elastic(136e3, 0.3, 1000.0)},
    formulation="plane_strain",
    supports={"top": ("x", "y")},
    contacts=(PLATE,),
    programme=(fs.Press(0.2e-3, 1e-3), fs.Hold(1e-3), fs.Slide(0.4e-3, 1e-3)),
    time=fs.TimeStepping(5e-3),
)
FAR = dataclasses.replace(PLATE, counterface=fs.Plane(normal=(0, 1), offset=-1e-3), search_distance=5e-3)
WEAKENING = dataclasses.replace(PLATE, friction=fs.StaticKinetic(0.6, 0.4, 1e-3), rigid_body="block")
RINGING: dict[str, object] = {
    "contacts": (WEAKENING,),
    "bodies": {"block": fs.RigidBody(0.1, free=("x", "y"))},
    "time": fs.TimeStepping(5e-3, end=0.1),
}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"time": fs.TimeStepping(10e-3)}, ["programme.0: the press takes 20 steps", "a step of 8 ms or less"]),
        ({"time": fs.QuasiStatic(20e-3)}, ["programme.2: the slide takes 20 steps"]),
        (
            {"contacts": (dataclasses.replace(PLATE, counterface=fs.Plane(normal=(0, -2))),)},
            ["contacts.0.counterface: its normal points away from the body", "write (0, 1)"],
        ),
        (
            {"contacts": (FAR,), "programme": (fs.Press(0.2e-3, 1e-3),)},
            ["contacts.0: never touches 'bottom', which is 1 mm away", "comes 0.2 mm nearer"],
        ),
        (
            {"mesh": box("Q4", np.linspace(0.0, 10e-3, 9), np.linspace(0.0, 4e-3, 5))},
            ["contacts.0: 9 nodes of 'bottom' are in reach", "take smaller elements there"],
        ),
        (
            RINGING,
            ["contacts.0.friction: falls from static to kinetic on 'block'", "write a damping"],
        ),
        ({"supports": {}}, ["supports: there are none", "support a boundary"]),
        ({"materials": {"bulk": fs.Elastic(136.0, 0.3, 1000.0)}}, ["materials.bulk: a modulus of 136 Pa", "136e3"]),
    ],
)
def test_what_is_hardly_meant_is_named_and_nothing_else(changes: dict[str, object], words: list[str]) -> None:
    model = dataclasses.replace(MODEL, **changes)
    texts = doubts(model, inspect_model(model))
    assert all(any(word in text for text in texts) for word in words), texts
    assert len(texts) <= 2


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"time": fs.Adaptive(50e-3)},
        RINGING | {"damping": fs.RayleighDamping(stiffness=1e-3)},
        {"time": fs.QuasiStatic(10e-3), "programme": (fs.Press(0.2e-3, 1e-3),)},
    ],
    ids=["plain", "adaptive", "damped", "a press without inertia needs few steps"],
)
def test_a_model_that_is_meant_has_no_doubts(changes: dict[str, object]) -> None:
    model = dataclasses.replace(MODEL, **changes)
    assert doubts(model, inspect_model(model)) == ()


def test_simulating_says_them_and_which_plate_never_touched(caplog: pytest.LogCaptureFixture) -> None:
    away = dataclasses.replace(PLATE, counterface=fs.Plane(normal=(0, 1), offset=-0.5))
    changes = {"contacts": (away,), "programme": (), "supports": {}, "tractions": {"bottom": (0.0, 0.1)}}
    with caplog.at_level(logging.WARNING, logger="fingerslip.dynamics"):
        fs.simulate(dataclasses.replace(MODEL, **changes, time=fs.TimeStepping(0.1, end=0.2)))
    assert "supports: there are none" in caplog.text
    assert "contacts.0: never touches 'bottom'; the smallest gap is" in caplog.text
