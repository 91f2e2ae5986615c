"""What cannot be computed is refused, each with what to write instead; what is hardly meant is said."""

import dataclasses
import logging
from types import SimpleNamespace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.recording.schedule import step_times
from fingerslip.dynamics.statics.body import static_body
from fingerslip.dynamics.system.checks import inspect_model
from fingerslip.dynamics.system.doubts import doubts
from fingerslip.errors import MeshError
from fingerslip.verification.meshes import box
from problems.domes import pressed_dome
from problems.held import held
from problems.pushed import pad, push_and_slide
from unit.dynamics.models import contact, oscillator, pressed_pad, resting, slid_block, supported_block

BODY, FREE = fs.RigidBody(1.0), fs.RigidBody(0.02, free=("x", "y"))
PRESS, SLIDE = fs.Press(1e-3, 1e-3), fs.Slide(1e-3, 1e-3)
ASIDE = fs.Ramp((0.0, 0.1), (0.0, 1.0))
LOWERED = {"supports": {"top": ("x", "y")}, "support_motions": {"top": fs.SupportMotion((0.0, -1e-4), ASIDE)}}
CUBE = box("H8", *[np.linspace(0.0, 4e-3, 3)] * 3)
STATIC = fs.QuasiStatic(5e-3)
TERMS = (fs.PronyTerm(0.3, 4e-3), fs.PronyTerm(0.3, 0.07))
NEO_HOOKEAN = {"kinematics": "finite", "materials": {"bulk": fs.NeoHookean(1e5, 0.45, 1e3)}}
TISSUE, RELAXING = fs.Elastic(34e3, 0.4, 1000.0), fs.NeoHookean(34e3, 0.45, 1000.0, prony=TERMS)
PARTS = {"ALL": (0, 32), "most": (1, 32), "pulp": (0, 4), "skin": (4, 32)}
BETWEEN = r"time.end: got 1 s, which is 3.333 steps of 0.3 s, .* write 0.9 s or 1.2 s, or a step of 0.25 s"


def plane(**values):
    return {"contacts": contact(counterface=fs.Plane(**values))}


def pressed_and_slid(direction, depth=1e-3):
    return {"programme": (fs.Press(depth, 1e-3), fs.Slide(1e-3, 1e-3, direction))}


def touched_inside(around, *others):
    """Return a pad whose boundary `touch` is the sides between its cells around a point, and others."""
    mesh = pad("Q4")
    centres = mesh.p[:, mesh.facets].mean(axis=1)
    near = (np.abs(centres - np.array(around)[:, None]).sum(axis=0) < 0.7e-3) & (mesh.f2t[1] >= 0)
    facets = [np.flatnonzero(near), *(mesh.boundaries[name] for name in others)]
    return mesh.with_boundaries({"touch": np.concatenate(facets)})


# Of the small press and slide.
MODELS = [
    ({"contacts": contact(boundary="pulp")}, "boundary 'pulp' not in mesh, it has: bottom, left, right, top"),
    ({"supports": {"nail": ("x",)}}, "boundary 'nail' not in mesh"),
    ({"materials": dict.fromkeys(("a", "b"), TISSUE), "supports": {"nail": ("x",)}, "contacts": contact(boundary="c")},
     "(?s)materials.a: no such region.*materials.b: no such region.*boundary 'c' not.*boundary 'nail' not"),
    ({"mesh": touched_inside((0.5e-3, 1.0e-3), "top"), "contacts": contact(boundary="touch")},
     r"contacts.0.boundary: 1 of the 9 facets of 'touch' lie inside .* in place of S4, say\), such as those of bottom"),
    ({"mesh": touched_inside((0.0, 2.2e-3)), "contacts": contact(boundary="touch")},
     "all 3 facets of 'touch' lie inside the body, needs facets on the outside; name facets on the outside$"),
    ({"supports": {"top": ("z",)}}, "supports.top: got component 'z', needs x or y"),
    ({"supports": {"bulk": ("x", "y")}}, "supports: fix every degree of freedom"),
    ({"tractions": {"left": (1.0,)}}, "tractions.left: got 1 components, needs 2"),
    ({"materials": {}}, "region 'bulk' has no material"),
    ({"mesh": dataclasses.replace(pad("Q4"), _subdomains={name: np.arange(*of) for name, of in PARTS.items()}),
      "materials": {"skin": TISSUE}}, "materials: region 'pulp' has no material, every cell needs one, by one of its"),
    ({"materials": {"Bulk": TISSUE}}, "materials.Bulk: no such region in the mesh, it has: bulk; did you mean 'bulk'"),
    ({"contacts": contact(boundary="BOTTOM")}, "boundary 'BOTTOM' not in mesh, it .* top; did you mean 'bottom'"),
    ({"mesh": pad("Q4").with_subdomains({"twin": np.array([0])}), "materials": dict.fromkeys(("bulk", "twin"), TISSUE)},
     "shares cells with another, a cell has one material"),
    ({"sites": (fs.Site("far", "", (1.0, 1.0)),)}, "site far: x = 1000 mm"),
    ({"sites": (fs.Site("a", "", (0.0, 0.0), "nail"),)}, "region 'nail' is not in the mesh"),
    # Counterfaces, and programmes that move them.
    (plane(offset=1e-3), "contacts.0.offset: the counterface starts 1 mm inside the body, needs an offset <= 0 mm"),
    (plane(offset=-1.0), "no node of the boundary is within 0.6 mm of the counterface"),
    ({"mesh": CUBE, "formulation": "solid", "depth": 1.0, **plane(normal=(1, 0, 0)), "programme": (PRESS,)},
     r"contacts.0.counterface: meets 3 nodes of 'bottom', all on a line, .* a plate with the normal \(0, 0, 1\)"),
    ({"mesh": CUBE.with_boundaries({"skin": CUBE.boundary_facets()}), "formulation": "solid", "depth": 1.0,
      "contacts": contact(boundary="skin", counterface=fs.Plane(normal=(1, 0, 1))),
      "programme": (fs.Press(2e-4, 1e-3),)},
     "meets 3 nodes of 'skin', all on a line, needs to meet more than an edge; .* with the normal of one of its sides"),
    ({"mesh": CUBE, "formulation": "solid", "depth": 1.0, "contacts": contact(counterface=fs.Cylinder(8e-3))},
     r"counterface.axis: is missing, needs a direction in 3D; write for example normal: \[0, 1, 0\] and axis: \["),
    ({"contacts": contact(counterface=fs.Cylinder(8e-3, axis=(0, 0, 1)))},
     r"counterface.axis: got \(0.0, 0.0, 1.0\), needs a direction in 3D and none in 2D"),
    (plane(normal=(0, 0, 1)), "contacts.0.counterface.normal: got 3 components, needs 2"),
    ({"contacts": contact(counterface=fs.Plane(offset=-1e-3), clearance=0.2e-3)},
     "contacts.0.clearance: got 0.2 mm for a counterface whose start is given, needs a counterface without"),
    ({"contacts": contact(clearance=0.3e-3), "programme": (fs.Press(0.25e-3, 1e-3), SLIDE)},
     "slides before the counterface touches"),
    ({"programme": (SLIDE, PRESS)}, "slides before the counterface touches"),
    ({"programme": (fs.Press(4.5e-3, 1e-3),)},
     "programme: presses 4.5 mm deep, needs less than the 4 mm between the contact and what the supports hold"),
    ({"contacts": contact(programme=(fs.Press(2e-3, 1e-3), fs.Lift(1e-3, 1e-3), fs.Press(3e-3, 1e-3)))},
     "contacts.0.programme: presses 4 mm deep"),
    ({"programme": (fs.Press(4.5e-3, 1e-3),), "contacts": contact(boundary="right", counterface=fs.Plane((0, 1)))},
     r"0.counterface.normal: presses along \(0, 1\) while 'right' faces \(1, 0\), .* write normal: \[-1, 0\]$"),
    *((changes, r"normal: presses along \(0, -1\) while 'bottom' faces \(0, -1\), .* body, \(0, 1\); .* \[0, 1\]$")
      for changes in (plane(normal=(0, -2)), plane(normal=(0, -1), offset=0.1e-3),
                      {"contacts": contact(counterface=fs.Cylinder(8e-3, normal=(0, -1)))})),
    ({"programme": (fs.Press(4.2e-3, 1e-3),), "contacts": contact(clearance=0.1e-3)}, "presses 4.1 mm deep"),
    (
        {
            "programme": (fs.Press(0.05e-3, 1e-3), SLIDE),
            "contacts": contact(counterface=fs.Plane(offset=-0.1e-3), search_distance=1e-3),
        },
        "deeper than the gap",
    ),
    *((pressed_and_slid(way), "along the counterface") for way in ((0.0, 1.0), (0.0, 0.0), (1e-9, 1.0))),
    (pressed_and_slid((1.0, 0.0, 0.0)), "programme.1.slide.direction: got 3 components, needs 2"),
    ({"contacts": contact(friction=fs.Anisotropic(0.4, 0.8))}, "contacts.0.friction: got Anisotropic in 2 .*needs 3"),
    # Loads, and steps without inertia.
    ({"gravity": (9.81,)}, "gravity: got 1 components, needs 2"),
    ({"initial_velocity": (1.0,)}, "initial_velocity: got 1 components, needs 2"),
    ({"initial_velocity": (1.0, 0.0), "time": STATIC}, "initial_velocity: is given for a model without inertia"),
    ({"contacts": contact(drive=fs.Drive(1.0, 1.0)), "time": STATIC},
     "contacts.0.drive: got a force that drives a counterface in a model without inertia"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "message"), MODELS)
def test_models_that_cannot_be_computed_are_refused_by_the_check_and_by_the_simulation(changes, message):
    model = push_and_slide(**changes)
    for refuse in (inspect_model, fs.simulate):
        with pytest.raises(fs.InputError, match=message) as caught:
            refuse(model)
        assert isinstance(caught.value, MeshError) == ("not in mesh" in message)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"body": fs.RigidBody(1.0, free=("z",))}, r"bodies.jug.free: got 'z' in 2 dimensions, needs x, y, rz"),
        ({"body": fs.RigidBody(1.0, centre=(0.0,))}, r"bodies.jug.centre: got 1 components, needs 2"),
        ({"body": fs.RigidBody(1.0, free=("rz",), centre=(0.0, 0.0), inertia=(1.0, 1.0, 1.0))},
         r"bodies.jug.inertia: got 3 values, needs 1"),
        ({"body": fs.RigidBody(1.0, free=("x",), programme=(PRESS,))},
         r"bodies.jug.programme: moves the body along x, the body is free along x"),
        ({"body": fs.RigidBody(1.0, programme=(fs.Slide(1e-3, 1e-3, (-1.0, 0.0)),))},
         r"bodies.jug.programme.0.slide.direction: got \[-1.0, 0.0\], needs a direction along the counterface"),
        ({"bodies": {"jug": FREE, "bowl": fs.RigidBody(1.0, programme=(PRESS,))}},
         r"bodies.bowl.programme: is given for a body that no counterface is on.*; write 'rigid_body: bowl' in"),
        ({"friction": fs.Coulomb(0.0), "time": fs.QuasiStatic(1e-3, end=0.1)},
         r"bodies.jug.free: nothing holds the body in y, a spring, a damper or a contact .*; hold it, or take Time"),
        (
            {
                "body": dataclasses.replace(FREE, initial_velocity=fs.BodyVelocity(x=1.0)),
                "time": fs.QuasiStatic(1e-3, end=0.1),
            },
            r"bodies.jug.initial_velocity: is given for a model without inertia",
        ),
    ],
)  # fmt: skip
def test_bodies_that_cannot_be_computed_are_refused(changes, message):
    with pytest.raises(fs.InputError, match=message):
        inspect_model(held(**changes))


def on_body(**changes):
    return push_and_slide(contacts=contact(rigid_body="jug", **changes), bodies={"jug": FREE})


def moved_support(held, motion):
    motions = {name: fs.SupportMotion(way, ASIDE) for name, way in motion.items()}
    fs.simulate(supported_block(supports={"top": held, "left": ("x",)}, support_motions=motions))


def commanded(changes, *command, **values):
    with fs.Simulation(slid_block(**changes)) as sim:
        sim.step(fs.Command(*command, **values))


def stepped(*calls):
    sim = fs.Simulation(slid_block(time=fs.TimeStepping(5e-3, end=10e-3)))
    for call in calls:
        getattr(sim, call)()


SLIDER = {
    "contacts": contact(counterface=fs.Plane((0.0, 1.0)), rigid_body="block"),
    "bodies": {"block": fs.RigidBody(mass=1.0, free=("x",))},
    "programme": (),
    "time": fs.TimeStepping(5e-3, end=0.1),
}
BALL = dataclasses.replace(pressed_dome().contacts[0], counterface=fs.Sphere(5e-3, (0.0, 1.0, 0.0)))
NO_SCHEME = SimpleNamespace(step=0.1, end=1.0, end_weight=1.0)


def condensed(reach=1e-3, **changes):
    static_body(pressed_dome(**changes), reach=reach, hidden=1e-3)


def timed(time):
    return dataclasses.replace(oscillator(0.1, 0.0, 6.0), time=time)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        # What is no model.
        (lambda: fs.simulate(fs.preset("wang2014-2d")),
         r"model: got a Fingertip, needs a Model; write fs.Model\(mesh="),
        (lambda: fs.simulate(None), r"model: got None, needs a Model; write fs.Model\("),
        (lambda: fs.simulate(pad("Q4")), "model: got a MeshQuad1, needs a Model"),
        (lambda: fs.simulate_together("x"), r"models: got 'x', needs a list of models; write fs.Model\("),
        (lambda: fs.simulate_together(push_and_slide()), r"models: got a Model, needs a list of models; write \[model"),
        (lambda: fs.simulate_together([push_and_slide(), 3]), "models.1: got 3, needs a Model"),
        (lambda: fs.simulate_together([]), "models: got none, needs one or more"),
        # Steps, and what makes them.
        (lambda: fs.simulate(push_and_slide(time=fs.TimeStepping(step=0.3, end=1.0))), BETWEEN),
        (lambda: fs.simulate(push_and_slide(time=fs.QuasiStatic(step=0.3, end=1.0))), BETWEEN),
        (lambda: fs.simulate(push_and_slide(step=1.0)), r"time.step: got 1 s for a run of 0.22 s, needs at least one"),
        (lambda: fs.simulate(push_and_slide(step=1e-12)),
         r"time.step: 2.2e\+11 steps of 1e-12 s need about .* GB for their records, .* write a step of at least"),
        (lambda: step_times(push_and_slide(time=fs.Adaptive(1e-12))), r"time\.output: .* GB are available"),
        (lambda: timed(5e-3), r"Model.time: got 0.005, needs the time integration: TimeStepping, Quasi"),
        (lambda: fs.simulate(timed(NO_SCHEME)),
         "time: got a SimpleNamespace, needs TimeStepping, QuasiStatic, Adaptive or a Scheme"),
        (lambda: push_and_slide(time=fs.Adaptive(5e-3), basis=fs.ReducedBasis()), r"basis: .* fixed length"),
        (lambda: fs.Simulation(push_and_slide(time=fs.Adaptive(5e-3))), "time: controls its own steps"),
        # Relaxation that is faster than half a step.
        *(
            (
                lambda time=time, kinematics=kinematics: fs.simulate(
                    push_and_slide(time=time, materials={"bulk": RELAXING}, kinematics=kinematics)
                ),
                rf"materials\.bulk\.prony\.0\.time: got 0\.004 s for a step of {step} s",
            )
            for time, kinematics, step in (
                (fs.Adaptive(20e-3, smallest=10e-3), "small", r"0\.01"),
                (fs.TimeStepping(0.02), "small", r"0\.02"),
                (fs.TimeStepping(0.02), "finite", r"0\.02"),
            )
        ),
        # Supports, and what contact alone holds.
        (lambda: fs.Ramp((0.0, 0.0), (1.0, 2.0)), "needs ascending times, a factor for each"),
        (lambda: fs.SupportMotion((0.0, 1e-3), fs.Ramp((0.0, 1.0), (1.0, 1.0))),
         r"ramp: starts from a factor of 1, needs 0 at the start"),
        (lambda: moved_support(("x", "y"), {"lid": (0.0, 1e-3)}),
         r"support_motions.lid: moves what is no support, the supports are: top"),
        (lambda: moved_support(("x", "y"), {"top": (1e-3,)}), r"top.displacement: got 1 components, needs 2"),
        (lambda: moved_support(("y",), {"top": (1e-3, 0.0)}),
         r"top.displacement: moves along x, the support holds y; hold x as well, or write 0 there"),
        (lambda: fs.simulate(resting(contacts=(), supports={"left": ("x",)})),
         r"supports: leave translation along y free, have to hold a body"),
        (lambda: inspect_model(resting(supports={"left": ("x",)}, **NEO_HOOKEAN)),
         r"supports: leave it to contact alone .*; support it, take TimeStepping, or"),
        # Contacts on bodies, and counterfaces of condensed ones.
        (lambda: push_and_slide(contacts=contact(rigid_body="jar"), bodies={"jug": FREE}),
         r"contacts.0.rigid_body: got 'jar', the bodies are: jug"),
        (lambda: on_body(drive=fs.Drive(1.0, 1.0)),
         r"contacts.0.drive: is given with rigid_body, needs one of the two; give the motion of body 'jug' in"),
        (lambda: on_body(programme=()), r"contacts.0.programme: is given with rigid_body"),
        (lambda: condensed(time=fs.TimeStepping(1e-3)), "time: has inertia"),
        (lambda: condensed(gravity=(0.0, -9.81, 0.0)), "loads: act beside"),
        (lambda: condensed(**NEO_HOOKEAN), "kinematics: is finite"),
        (lambda: condensed(contacts=(BALL,)), "is curved"),
        (lambda: condensed(reach=-1.0), "reach: got -1"),
        # The short search for candidates leaves it to the checks to say what is wrong.
        (lambda: fs.simulate(pressed_pad(**pressed_and_slid((0.0, 0.0, 1.0), depth=0.4e-3))),
         r"programme.1.slide.direction: got .*, needs a direction along"),
        # Steps from outside, and commands.
        (lambda: stepped("step", "step", "step"), "end: is reached, 0.01 s"),
        (lambda: stepped("close", "step"), "simulation: is closed, takes no more steps"),
        (lambda: commanded({}, "side", velocity=(0.0, 0.0)),
         "^command.of: got 'side', the bodies, contacts and moving supports are: bottom"),
        (lambda: commanded(LOWERED, "top", velocity=(1e-3, -1e-3)),
         "^command.velocity: moves 'top' along x, where it cannot, needs components that its motion has; give"),
        (lambda: commanded(LOWERED, "top", force=(0.0, 1.0)), "^command.force: 'top' is a support"),
        (lambda: commanded({}, "bottom", velocity=(0.0,)), "^command.velocity: got 1 components, needs 2"),
        (lambda: commanded({}, "bottom", force=(0.0, 1.0)), "^command.force: 'bottom' is free along no direction"),
        (lambda: commanded(SLIDER, "block", velocity=(0.1, 0.0)),
         "^command.velocity: moves along a direction in which the body is free"),
    ],
)  # fmt: skip
def test_what_cannot_be_computed_is_refused(call, message):
    with pytest.raises(fs.InputError, match=message):
        call()


@pytest.mark.parametrize("element", ["T3", "T6"])
def test_a_mesh_that_folds_over_itself_is_refused(element):
    """Where its cells are of one material, and of two that meet at the fold."""

    def folded(points):
        moved = points.copy()
        moved[0, np.isclose(points, [[0.0], [2e-3]]).all(axis=0)] = 1.7e-3
        return moved

    halves = {"left": lambda x: x[0] < 0.0, "right": lambda x: x[0] > 0.0}
    for regions in (None, halves):
        mesh = box(element, np.linspace(-4e-3, 4e-3, 9), np.linspace(0.0, 4e-3, 5), shift=folded, regions=regions)
        model = push_and_slide(mesh=mesh, materials=dict.fromkeys(mesh.subdomains, TISSUE))
        for refuse in (inspect_model, fs.simulate):
            with pytest.raises(MeshError, match=r"^mesh: has cells that fold over each other: .* mm .* edge; move"):
                refuse(model)


@pytest.mark.parametrize(
    "changes",
    [
        {"programme": (fs.Press(4.5e-3, 1e-3),), "supports": {"top": ("x",)}},
        {"programme": (fs.Press(4.5e-3, 1e-3),), "supports": {"bulk": ("y",), "top": ("x", "y")}},
        {"programme": (fs.Press(4.2e-3, 1e-3),), "contacts": contact(clearance=0.35e-3)},
        {
            "mesh": pad("Q4").with_boundaries({"foot": lambda x: (x[0] < -3.9e-3) & (x[1] < 1.6e-3)}),
            "contacts": contact(
                boundary="top", counterface=fs.Plane(normal=(4, 1)), programme=(fs.Press(0.2e-3, 1e-3),)
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
LOCKING: dict[str, object] = {
    "mesh": box("T3", np.linspace(0.0, 10e-3, 21), np.linspace(0.0, 4e-3, 5)),
    "materials": {"bulk": fs.Elastic(136e3, 0.48, 1000.0)},
}
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
        # Samples of a motion, however many steps each takes.
        ({"time": fs.TimeStepping(10e-3), "programme": (fs.Press(0.01e-3, 1e-3),) * 40}, []),
        ({"contacts": (dataclasses.replace(PLATE, counterface=fs.Plane(normal=(1, 0))),)},
         ["contacts.0.counterface: its normal (1, 0) runs along 'bottom'", "take the normal (0, 1)"]),
        ({"mesh": TWO_SIDED, "contacts": (fs.Contact("both", fs.Plane(normal=(1, 0)), fs.Coulomb(0.5)),)},
         ["its normal (1, 0) runs along 'both' and meets only an edge: take the normal of one of its sides"]),
        ({"contacts": (FAR,), "programme": (fs.Press(0.2e-3, 1e-3),)},
         ["contacts.0: never touches 'bottom', which is 1 mm away", "comes 0.2 mm nearer"]),
        ({"mesh": box("Q4", np.linspace(0.0, 10e-3, 9), np.linspace(0.0, 4e-3, 5))},
         ["contacts.0: 9 nodes of 'bottom' are in reach", "take smaller elements there"]),
        ({"programme": (fs.Press(3.7e-3, 20e-3),)},
         ["contacts.0: is pressed 3.7 mm deep into a body of 4 mm along its normal: press less deep, and check the"]),
        ({"programme": (fs.Press(3.5e-3, 20e-3),)}, []),
        # All 21 nodes are in reach, but only every second one is the tip of a ridge.
        ({"mesh": RIDGED}, ["touches first it turns by 23 degrees", "take elements of about 0.23 mm there"]),
        (SLAB_OF_9, ["contacts.0: 18 nodes of 'bottom' are in reach of the counterface, 9 along the slide, and fewer"]),
        (SLAB_OF_21, []),
        # The corners of its sides are as near as the flat bottom.
        ({"mesh": SIDES, "contacts": (dataclasses.replace(PLATE, boundary="outline"),)}, []),
        (RINGING, ["contacts.0.friction: falls from static to kinetic on 'block'", "write a damping"]),
        ({"supports": {}}, ["supports: there are none", "support a boundary"]),
        ({"materials": {"bulk": fs.Elastic(136.0, 0.3, 1000.0)}}, ["materials.bulk: a modulus of 136 Pa", "136e3"]),
        (LOCKING, ["integration: 100 % of the cells are linear triangles of a nearly incompressible", "nodal, or"]),
        (LOCKING | {"integration": "nodal"}, []),
        (LOCKING | {"formulation": "plane_stress"}, []),
        (LOCKING | {"materials": MODEL.materials}, []),
        ({}, []),
        ({"time": fs.Adaptive(50e-3)}, []),
        (RINGING | {"damping": fs.RayleighDamping(stiffness=1e-3)}, []),
        # A press without inertia needs few steps.
        ({"time": fs.QuasiStatic(10e-3), "programme": (fs.Press(0.2e-3, 1e-3),)}, []),
    ],
)  # fmt: skip
def test_what_is_hardly_meant_is_named_and_nothing_else(changes: dict[str, object], words: list[str]) -> None:
    model = dataclasses.replace(MODEL, **changes)
    texts = [doubt.text for doubt in doubts(model, inspect_model(model))]
    assert all(any(word in text for text in texts) for word in words), texts
    assert len(texts) <= (2 if words else 0)


def test_few_steps_and_nodes_of_the_slide_are_what_runs_measure() -> None:
    few = fs.Press(0.2e-3, 1e-3), fs.Slide(0.1e-3, 1e-3)
    changes: dict[str, object] = SLAB_OF_9 | {"time": fs.TimeStepping(50e-3), "programme": few}
    model = dataclasses.replace(MODEL, **changes)
    measured = {doubt.text.partition(" takes")[0].partition(" nodes")[0]: doubt.is_measured
                for doubt in doubts(model, inspect_model(model))}  # fmt: skip
    assert measured == {"programme.0: the press": False, "programme.1: the slide": True, "contacts.0: 18": True}


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
