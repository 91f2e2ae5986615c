"""Models that cannot be computed are refused before anything is assembled, and what is doubtful is said."""

import dataclasses
import logging

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.system.checks import inspect_model
from fingerslip.dynamics.system.doubts import doubts
from fingerslip.verification.meshes import box
from problems.pushed import pad, push_and_slide
from unit.dynamics.models import contact


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
def test_a_press_goes_as_deep_as_what_the_supports_hold_lets_it(changes, caplog):
    """It is warned of where it strains the body too much."""
    inspect_model(push_and_slide(**changes))
    caplog.clear()
    inspect_model(push_and_slide(programme=(fs.Press(1.9e-3, 1e-3),)))
    assert not caplog.records
    inspect_model(push_and_slide(programme=(fs.Press(2.1e-3, 1e-3),)))
    assert "presses 2.1 mm deep, 52 % of the 4 mm" in caplog.text


@pytest.mark.parametrize("counterface", [fs.Plane(), fs.Cylinder(8e-3), fs.Plane(normal=(0.1, 1.0))])
def test_a_clearance_is_the_gap_along_the_normal_at_the_start(counterface):
    still = {"programme": (), "time": fs.QuasiStatic(0.1, end=0.1)}
    touching, apart = (
        fs.simulate(
            push_and_slide(contacts=contact(counterface=counterface, clearance=way, search_distance=1.0), **still)
        )
        for way in (0.0, 0.35e-3)
    )
    points = touching.contact_position.values
    assert float(touching.gap[0].min()) == pytest.approx(0.0, abs=1e-12)
    moved = counterface.at_start(points).gap(points + 0.35e-3 * counterface.unit_normal)
    np.testing.assert_allclose(apart.gap[0], moved, atol=1e-12)


@pytest.mark.parametrize(
    ("supports", "free"), [({"top": ("y",), "left": ("x",)}, 90 - 9 - 5), ({"bulk": ("y",), "top": ("x", "y")}, 45 - 9)]
)
def test_boundaries_and_whole_regions_are_supported(supports, free):
    """The latter along y, so that the body shears as a whole."""
    still = {"programme": (), "contacts": (), "time": fs.QuasiStatic(0.1, end=0.1)}
    assert fs.simulate(push_and_slide(**still, supports=supports)).attrs["n_degrees_of_freedom"] == free


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
SLAB_OF_9, SLAB_OF_21 = (
    {
        "mesh": box("H8", np.linspace(0.0, 10e-3, count), np.array([0.0, 2e-3]), np.linspace(0.0, 4e-3, 5)),
        "formulation": "solid",
        "contacts": (dataclasses.replace(PLATE, counterface=fs.Plane(normal=(0, 0, 1))),),
    }
    for count in (9, 21)
)
SIDES = MODEL.mesh.with_boundaries(
    {"outline": np.concatenate([MODEL.mesh.boundaries[side] for side in ("bottom", "left", "right")])}
)
TWO_SIDED = MODEL.mesh.with_boundaries({"both": np.concatenate([MODEL.mesh.boundaries[s] for s in ("bottom", "top")])})
_X, _Y = MODEL.mesh.p
RIDGED = dataclasses.replace(MODEL.mesh, doflocs=np.array([_X, _Y + 1e-4 * (_Y == 0) * np.sin(1e3 * np.pi * _X) ** 2]))
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
        ({"contacts": (dataclasses.replace(PLATE, counterface=fs.Plane(normal=(0, -2))),)},
         ["contacts.0.counterface: its normal points away from the body", "write (0, 1)"]),
        ({"contacts": (dataclasses.replace(PLATE, counterface=fs.Plane(normal=(1, 0))),)},
         ["contacts.0.counterface: its normal (1, 0) runs along 'bottom'", "take the normal (0, 1)"]),
        ({"mesh": TWO_SIDED, "contacts": (fs.Contact("both", fs.Plane(normal=(1, 0)), fs.Coulomb(0.5)),)},
         ["its normal (1, 0) runs along 'both' and meets only an edge: take the normal of one of its sides"]),
        ({"contacts": (FAR,), "programme": (fs.Press(0.2e-3, 1e-3),)},
         ["contacts.0: never touches 'bottom', which is 1 mm away", "comes 0.2 mm nearer"]),
        ({"mesh": box("Q4", np.linspace(0.0, 10e-3, 9), np.linspace(0.0, 4e-3, 5))},
         ["contacts.0: 9 nodes of 'bottom' are in reach", "take smaller elements there"]),
        # All 21 nodes are in reach, but only every second one is the tip of a ridge.
        ({"mesh": RIDGED}, ["touches first it turns by 23 degrees", "take smaller elements there"]),
        (SLAB_OF_9, ["contacts.0: 18 nodes of 'bottom' are in reach of the counterface, 9 along the slide, and fewer"]),
        (SLAB_OF_21, []),
        # The corners of its sides are as near as the flat bottom.
        ({"mesh": SIDES, "contacts": (dataclasses.replace(PLATE, boundary="outline"),)}, []),
        (RINGING, ["contacts.0.friction: falls from static to kinetic on 'block'", "write a damping"]),
        ({"supports": {}}, ["supports: there are none", "support a boundary"]),
        ({"materials": {"bulk": fs.Elastic(136.0, 0.3, 1000.0)}}, ["materials.bulk: a modulus of 136 Pa", "136e3"]),
        ({}, []),
        ({"time": fs.Adaptive(50e-3)}, []),
        (RINGING | {"damping": fs.RayleighDamping(stiffness=1e-3)}, []),
        # A press without inertia needs few steps.
        ({"time": fs.QuasiStatic(10e-3), "programme": (fs.Press(0.2e-3, 1e-3),)}, []),
    ],
)  # fmt: skip
def test_what_is_hardly_meant_is_named_and_nothing_else(changes: dict[str, object], words: list[str]) -> None:
    model = dataclasses.replace(MODEL, **changes)
    texts = doubts(model, inspect_model(model))
    assert all(any(word in text for text in texts) for word in words), texts
    assert len(texts) <= (2 if words else 0)


def test_simulating_says_them_and_which_plate_never_touched(caplog: pytest.LogCaptureFixture) -> None:
    away = dataclasses.replace(PLATE, counterface=fs.Plane(normal=(0, 1), offset=-0.5))
    changes = {"contacts": (away,), "programme": (), "supports": {}, "tractions": {"bottom": (0.0, 0.1)}}
    with caplog.at_level(logging.WARNING, logger="fingerslip.dynamics"):
        fs.simulate(dataclasses.replace(MODEL, **changes, time=fs.TimeStepping(0.1, end=0.2)))
    assert "supports: there are none" in caplog.text
    assert "contacts.0: never touches 'bottom'; the smallest gap is" in caplog.text


def test_a_plate_that_waits_at_the_boundary_is_no_mistake(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, logger="fingerslip.dynamics"):
        fs.simulate(dataclasses.replace(MODEL, programme=(fs.Hold(20e-3),)))
    assert "the smallest gap" not in caplog.text
