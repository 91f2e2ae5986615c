"""Rigid bodies: Newton's law on their free directions, rotations, what histories say of them, and refusals."""

from __future__ import annotations

import dataclasses
import logging

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fingerslip as fs
from fingerslip.dynamics.system.checks import check_model
from fingerslip.errors import EquilibriumError, InputError
from fingerslip.verification.meshes import box
from problems.held import GRAVITY, MU, apart, held
from problems.pushed import push_and_slide
from unit.dynamics.models import error_of

FREE = fs.RigidBody(0.02, free=("x", "y"))


@pytest.mark.parametrize("dim", [2, 3])
def test_springs_dampers_and_loads_act_along_each_free_direction(dim):
    """Without inertia c (q_1 - q_0) / h + s q_1 = F in every step, of a body by itself."""
    spring, damper, load, step = 5.0, 7.0, 0.2, 0.1
    free = ("rz", "y") if dim == 2 else ("y", "rx", "ry", "rz")
    acting = [kind(**dict.fromkeys(free, value)) for kind, value in zip(
        (fs.Springs, fs.Dampers, fs.BodyLoad), (spring, damper, load), strict=True)]  # fmt: skip
    body = fs.RigidBody(
        2.0,
        free=free,
        centre=(1.0, 2.0, 3.0)[:dim],
        inertia=(3.0,) * (1 if dim == 2 else 3),
        springs=acting[0],
        dampers=acting[1],
        loads=(acting[2],),
    )
    mesh = box("Q4" if dim == 2 else "H8", *[np.linspace(0.0, 1.0, 2)] * dim)
    shape = {"formulation": "plane_strain" if dim == 2 else "solid", "supports": {"bottom": ("x", "y", "z")[:dim]}}
    history = fs.simulate(apart(body, mesh=mesh, **shape, time=fs.QuasiStatic(step, end=1.0)))
    expected = load / spring * (1.0 - (damper / (damper + spring * step)) ** np.arange(11))
    np.testing.assert_allclose(history.rigid_body_displacement.values[:, 0, 1], expected, rtol=1e-9)
    np.testing.assert_allclose(history.rigid_body_rotation.values[:, 0], np.tile(expected[:, None], (1, 2 * dim - 3)))
    assert not history.rigid_body_displacement.values[:, 0, [0, *range(2, dim)]].any()


def test_material_damping_leaves_rigid_bodies_and_driven_counterfaces_alone():
    """With the trapezoidal rule they fall exactly, the latter onto a block that it does not reach."""
    damping = fs.RayleighDamping(mass=30.0, stiffness=1e-3)
    history = fs.simulate(apart(FREE, gravity=(0.0, -GRAVITY), damping=damping))
    fallen = -0.5 * GRAVITY * history.time.values**2
    np.testing.assert_allclose(history.rigid_body_displacement.values[:, 0, 1], fallen, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(history.rigid_body_acceleration.values[:, 0], [[0.0, -GRAVITY]] * 101, rtol=1e-9)
    contact = fs.Contact("top", fs.Plane((0.0, -1.0), offset=-2.0), drive=fs.Drive(mass=0.02, force=0.04))
    history = fs.simulate(apart(FREE, bodies={}, contacts=(contact,), damping=damping))
    fallen *= 2.0 / GRAVITY
    np.testing.assert_allclose(history.counterface_displacement.values[:, 0, 1], fallen, rtol=1e-9, atol=1e-15)


def test_a_velocity_at_the_start_is_that_of_the_body_alone():
    body = dataclasses.replace(FREE, initial_velocity=fs.BodyVelocity(x=0.2))
    history = fs.simulate(apart(body))
    np.testing.assert_allclose(history.rigid_body_displacement.values[:, 0, 0], 0.2 * history.time.values, rtol=1e-9)
    assert float(history.kinetic_energy[0]) == pytest.approx(0.5 * 0.02 * 0.2**2)
    assert not history.strain_energy.values.any()


@pytest.mark.parametrize("element", ["Q4", "T6", "H8"])
def test_two_fingers_hold_an_object_by_friction_alone(element):
    history = fs.simulate(held(element, time=fs.TimeStepping(2e-3, end=0.2)))
    last = history.isel(time=-1)
    weight = 0.02 * GRAVITY
    # The fingers ring a little; the mean over the last half of the run does not.
    force = history.rigid_body_force.values[100 // 2 :, 0]
    np.testing.assert_allclose(force.mean(axis=0)[-1], weight, rtol=0.05)
    if element != "T6":  # triangles of both fingers lean to the same side
        assert np.abs(force[:, :-1]).max() < 1e-9 * weight, "the squeeze is symmetric"
        assert np.abs(last.rigid_body_displacement.values[0, :-1]).max() < 1e-12
    np.testing.assert_allclose(last.rigid_body_force.values[0], -last.counterface_force.values.sum(axis=0), atol=1e-15)
    both = history.friction_utilisation.values
    np.testing.assert_allclose(both[:, 0], both[:, 1], atol=1e-9 if element != "T6" else 0.1)
    assert 0.0 < both[-1, 0] < 1.0
    imbalance = np.abs(history.energy_imbalance.values).max()
    assert imbalance < 1e-9 * np.abs(history.external_work.values).max()


def test_newtons_law_holds_for_the_body_in_every_step():
    """The trapezoidal rule takes the equations of motion at the end of each step as they are."""
    history = fs.simulate(held(time=fs.TimeStepping(1e-3, alpha=0.0, end=0.2)))
    filled = np.interp(history.time.values, [0.05, 0.1], [0.0, 1.0])
    inertia = 0.02 * history.rigid_body_acceleration.values[1:, 0]
    forces = history.rigid_body_force.values[1:, 0] + np.outer(filled[1:], [0.0, -0.02 * GRAVITY])
    np.testing.assert_allclose(inertia, forces, atol=1e-9 * np.abs(forces).max())


def test_supports_of_both_fingers_carry_the_object():
    slow = fs.QuasiStatic(5e-3, end=0.15)
    history = fs.simulate(held(time=slow, gravity=None, body=_loaded(-0.2))).isel(time=-1)
    assert float(history.support_force.values[:, 1].sum()) == pytest.approx(0.2, rel=1e-8)
    np.testing.assert_allclose(history.support_force.values[:, 1], 0.1, rtol=1e-6)
    assert float(history.rigid_body_force.values[0, 1]) == pytest.approx(0.2, rel=1e-8)


def _loaded(force):
    return dataclasses.replace(FREE, loads=(fs.BodyLoad(y=force, ramp=fs.Ramp((0.05, 0.1), (0.0, 1.0))),))


def test_a_load_beyond_friction_has_no_equilibrium_and_the_error_names_the_body():
    model = held(time=fs.QuasiStatic(5e-3, end=0.2), gravity=None, body=_loaded(-5.0))
    with pytest.raises(EquilibriumError, match=r"contact alone does not hold the rigid body 'jug' \(x, y\)"):
        fs.simulate(model)


@pytest.mark.parametrize("time", [fs.TimeStepping(1e-3, end=0.2), fs.QuasiStatic(5e-3, end=0.2)])
def test_a_spring_carries_what_friction_does_not(time):
    """Without friction only the spring carries the load, at rest by load over stiffness."""
    body = dataclasses.replace(_loaded(-5.0), springs=fs.Springs(x=1e3, y=1e5), dampers=fs.Dampers(y=300.0))
    history = fs.simulate(held(time=time, gravity=None, body=body, friction=fs.Coulomb(0.0)))
    assert float(history.rigid_body_displacement[-1, 0, 1]) == pytest.approx(-5e-5, rel=1e-6)
    assert not history.friction_utilisation.values.any()


def test_a_pressed_body_is_free_along_the_surface():
    """A table that is pressed into the pad and free along it follows where the pad drags it: nothing else acts."""
    body = fs.RigidBody(0.01, free=("x",), programme=(fs.Press(0.4e-3, 4e-3), fs.Hold(0.1)))
    contact = fs.Contact("bottom", friction=fs.Coulomb(0.4), rigid_body="table")
    model = push_and_slide(contacts=(contact,), bodies={"table": body}, programme=())
    assert model.end == pytest.approx(0.2)
    history = fs.simulate(model)
    assert history.phase_kind.values.tolist() == ["press", "hold"]
    moved = history.rigid_body_displacement.values[:, 0]
    np.testing.assert_allclose(moved[:, 1], np.interp(history.time, [0.0, 0.1], [0.0, 0.4e-3]), atol=1e-15)
    np.testing.assert_array_equal(moved, history.counterface_displacement.values[:, 0])
    np.testing.assert_allclose(history.rigid_body_velocity.values[10, 0, 1], 4e-3)
    assert np.abs(moved[:, 0]).max() < 1e-12, "the pad is symmetric"


DISC = fs.Cylinder(20e-3, centre=(0.0, -20e-3))
TURNING = fs.RigidBody(
    1e-3,
    free=("y", "rz"),
    centre=(0.0, -2e-3),
    inertia=(1e-8,),
    springs=fs.Springs(rz=1e-3),
    loads=(fs.BodyLoad(y=0.01, rz=2e-5),),
)
SPRUNG = fs.RigidBody(1e-3, free=("y",), springs=fs.Springs(y=5.0), loads=(fs.BodyLoad(y=0.01),))


@pytest.mark.parametrize(
    ("body", "counterface", "basis"),
    [
        (TURNING, DISC, "reduced"),
        (SPRUNG, fs.Plane(), "reduced"),
        (dataclasses.replace(SPRUNG, dampers=fs.Dampers(y=0.5)), fs.Plane(), "full"),
    ],
    ids=["turning", "sprung", "damped"],
)
def test_a_reduced_basis_moves_the_body_as_the_mesh_does(body, counterface, basis, caplog):
    """Springs and masses are part of the basis; dampers are not, so that the motion is computed on the mesh."""
    contact = fs.Contact("bottom", counterface, fs.Coulomb(0.4), rigid_body="table")
    model = push_and_slide(
        contacts=(contact,), bodies={"table": body}, programme=(), time=fs.TimeStepping(1e-3, end=0.1)
    )
    full, reduced = (fs.simulate(dataclasses.replace(model, basis=own)) for own in (None, fs.ReducedBasis()))
    assert reduced.attrs["basis"] == basis
    assert ("rigid bodies have other damping than the material" in caplog.text) == (basis == "full")
    for name in ("rigid_body_displacement", "rigid_body_rotation", "counterface_force"):
        if "rz" in body.free or name == "rigid_body_displacement":
            assert error_of(reduced, full, name) < (1e-3 if "rz" in body.free else 1e-4), name


def test_an_object_and_a_finger_that_only_contact_holds_come_to_rest():
    """The right finger is pushed by its load alone, against the object, and this against the left finger."""
    ramp = fs.Ramp((0.0, 0.1), (0.0, 1.0))
    model = held(
        body=FREE,
        gravity=None,
        time=fs.QuasiStatic(0.02, end=0.1),
        supports={"left_left": ("x", "y")},
        support_motions={},
        tractions={"right_right": fs.Traction((-2e3, 0.0), ramp)},
    )
    history = fs.simulate(model).isel(time=-1)
    force = 2e3 * 10e-3 * 10e-3
    np.testing.assert_allclose(history.counterface_force.values, [[-force, 0.0], [force, 0.0]], atol=1e-8 * force)
    assert np.abs(history.rigid_body_force.values).max() < 1e-8 * force
    assert float(history.support_force[0, 0]) == pytest.approx(force, rel=1e-8)
    # The left finger is shorter by its strain, and the springs of contact give way, too.
    shift = float(history.rigid_body_displacement[0, 0])
    assert -1.1 * 2e3 / 1e5 * 10e-3 < shift < -0.8 * 2e3 / 1e5 * 10e-3


def test_utilisation_of_anisotropic_friction_is_one_in_any_direction():
    """The body is pulled along y and z by forces that friction cannot bear."""
    law = fs.Anisotropic(0.2, 0.6, (0.0, 0.0, 1.0))
    ramp = fs.Ramp((0.05, 0.06), (0.0, 1.0))
    body = fs.RigidBody(0.02, free=("y", "z"), loads=(fs.BodyLoad(y=3.0, z=2.0, ramp=ramp),))
    history = fs.simulate(held("H8", body=body, gravity=None, friction=law, time=fs.TimeStepping(2e-3, end=0.1)))
    np.testing.assert_allclose(history.largest_friction_utilisation.values[-1], 1.0, rtol=1e-6)
    np.testing.assert_allclose(history.friction_utilisation.values[-1], 1.0, rtol=1e-2)
    assert history.friction_utilisation.values.max() <= 1.0 + 1e-9


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"body": fs.RigidBody(1.0, free=("z",))}, r"bodies.jug.free: got 'z' in 2 dimensions, needs x, y, rz"),
        ({"body": fs.RigidBody(1.0, centre=(0.0,))}, r"bodies.jug.centre: got 1 components, needs 2"),
        (
            {"body": fs.RigidBody(1.0, free=("rz",), centre=(0.0, 0.0), inertia=(1.0, 1.0, 1.0))},
            r"bodies.jug.inertia: got 3 values, needs 1",
        ),
        (
            {"body": fs.RigidBody(1.0, free=("x",), programme=(fs.Press(1e-3, 1e-3),))},
            r"bodies.jug.programme: moves the body along x, the body is free along x",
        ),
        (
            {"body": fs.RigidBody(1.0, programme=(fs.Slide(1e-3, 1e-3, (-1.0, 0.0)),))},
            r"bodies.jug.programme.0.slide.direction: got \[-1.0, 0.0\], needs a direction along the counterface",
        ),
        (
            {
                "bodies": {"jug": FREE, "bowl": fs.RigidBody(1.0, programme=(fs.Press(1e-3, 1e-3),))},
            },
            r"bodies.bowl.programme: is given for a body that no counterface is on.*; write 'rigid_body: bowl' in",
        ),
        (
            {"friction": fs.Coulomb(0.0), "time": fs.QuasiStatic(1e-3, end=0.1)},
            r"bodies.jug.free: nothing holds the body in y, a spring, a damper or a contact .*; hold it, or take Time",
        ),
        (
            {
                "body": dataclasses.replace(FREE, initial_velocity=fs.BodyVelocity(x=1.0)),
                "time": fs.QuasiStatic(1e-3, end=0.1),
            },
            r"bodies.jug.initial_velocity: is given for a model without inertia",
        ),
    ],
)
def test_bodies_that_cannot_be_computed_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        check_model(held(**changes))


@pytest.mark.parametrize(
    ("contact", "message"),
    [
        (fs.Contact("bottom", rigid_body="jar"), r"contacts.0.rigid_body: got 'jar', the bodies are: jug"),
        (
            fs.Contact("bottom", rigid_body="jug", drive=fs.Drive(1.0, 1.0)),
            r"contacts.0.drive: is given with rigid_body, needs one of the two; give the motion of body 'jug' in",
        ),
        (fs.Contact("bottom", rigid_body="jug", programme=()), r"contacts.0.programme: is given with rigid_body"),
    ],
)
def test_contacts_on_bodies_that_do_not_fit_are_refused(contact, message):
    with pytest.raises(InputError, match=message):
        push_and_slide(contacts=(contact,), bodies={"jug": FREE})


def test_friction_utilisation_is_one_when_the_object_slides():
    history = fs.simulate(held(gravity=None, body=_loaded(-5.0)))
    assert history.friction_utilisation.values[-1] == pytest.approx([1.0, 1.0])
    normal = np.abs(history.counterface_force.values[-1, :, 0])
    np.testing.assert_allclose(np.abs(history.counterface_force.values[-1, :, 1]), MU * normal, rtol=1e-9)


# What histories say of them.


@pytest.fixture(scope="module", params=["Q4", "H8"])
def history(request):
    """Return an object, heavier on one side, that turns between the fingers until friction holds it."""
    dim = 2 if request.param == "Q4" else 3
    about = "rz" if dim == 2 else "ry"
    body = fs.RigidBody(
        0.02,
        free=("y" if dim == 2 else "z", about),
        centre=(0.0,) * dim,
        inertia=(1e-6,) * (1 if dim == 2 else 3),
        loads=(fs.BodyLoad(**{about: 2e-4}, ramp=fs.Ramp((0.05, 0.1), (0.0, 1.0))),),
    )
    model = held(request.param, body=body, gravity=None, time=fs.TimeStepping(1e-3, alpha=0.0, end=0.15))
    return fs.simulate(model)


def test_the_moment_of_contact_turns_the_body(history):
    """I times the angular acceleration is the applied moment and that of contact about the moved centre."""
    dim = history.sizes["component"]
    assert history.rigid_body.values.tolist() == ["jug"]
    assert history.rotation_axis.values.tolist() == (["z"] if dim == 2 else ["x", "y", "z"])
    np.testing.assert_array_equal(history.rigid_body_centre.values, np.zeros((1, dim)))
    axis = 0 if history.sizes["component"] == 2 else 1
    applied = np.interp(history.time.values, [0.05, 0.1], [0.0, 2e-4])
    inertia = 1e-6 * history.rigid_body_angular_acceleration.values[1:, 0, axis]
    np.testing.assert_allclose(
        history.rigid_body_moment.values[:, 0], -history.counterface_moment.values.sum(axis=1), atol=1e-15
    )
    contact = history.rigid_body_moment.values[1:, 0, axis]
    np.testing.assert_allclose(inertia, applied[1:] + contact, atol=1e-9 * 2e-4)
    assert contact[-20:].mean() == pytest.approx(-2e-4, rel=0.2)
    angle = history.rigid_body_rotation.values[:, 0, axis]
    assert 1e-4 < np.abs(angle).max() < 0.1
    rate = np.gradient(angle, history.time.values)
    np.testing.assert_allclose(
        history.rigid_body_angular_velocity.values[2:-2, 0, axis], rate[2:-2], atol=0.1 * np.abs(rate).max()
    )


def test_tractions_of_a_turning_face_are_in_its_frame(history):
    """The normal of a flat face turns with the body: friction has no part along it."""
    start = history.counterface_normal.values[history.contact_counterface.values]
    dim = start.shape[1]
    angles = np.zeros((history.sizes["time"], 3))
    angles[:, 2 if dim == 2 else slice(None)] = history.rigid_body_rotation.values[:, 0].squeeze()
    turned = Rotation.from_rotvec(angles).as_matrix()[:, :dim, :dim]
    along = np.einsum("tcd,tde,ce->tc", history.tangential_traction.values, turned, start)
    assert np.abs(along).max() < 1e-9 * history.normal_traction.values.max()


def test_a_round_object_without_friction_turns_as_if_nothing_touched_it():
    """Its surface moves along itself, so that neither gaps nor forces change, up to the square of the angle."""

    def pressed(free, moment=0.0):
        body = fs.RigidBody(
            1e-3,
            free=free,
            centre=(0.0, -20e-3),
            inertia=(1e-6,),
            programme=(fs.Press(0.2e-3, 4e-3), fs.Hold(0.05)),
            loads=(fs.BodyLoad(rz=moment),),
        )
        contact = fs.Contact("bottom", fs.Cylinder(20e-3, centre=(0.0, -20e-3)), fs.Coulomb(0.0), rigid_body="disc")
        time = fs.TimeStepping(1e-3, alpha=0.0)
        return fs.simulate(push_and_slide(contacts=(contact,), bodies={"disc": body}, programme=(), time=time))

    turned, still = pressed(("rz",), 1e-5), pressed(())
    angle = turned.rigid_body_rotation.values[:, 0, 0]
    np.testing.assert_allclose(angle, 0.5 * 1e-5 / 1e-6 * turned.time.values**2, rtol=1e-2)
    force = still.counterface_force.values[:, 0, 1]
    np.testing.assert_allclose(turned.counterface_force.values[:, 0, 1], force, atol=5e-3 * force.max())


# Rotations: any about one axis, small ones about several; larger ones are refused.


def turning(moment, *, free=("ry", "rz")):
    """Return a body by itself that turns by twice the static angle at most."""
    body = fs.RigidBody(
        mass=1.0,
        free=free,
        centre=(0.0, 2.0, 0.0),
        inertia=(1e-3,) * 3,
        springs=fs.Springs(**dict.fromkeys(free, 10.0)),
        loads=(fs.BodyLoad(rz=moment),),
    )
    return apart(
        body,
        mesh=box("H8", *(np.linspace(0.0, 1.0, 2),) * 3),
        formulation="solid",
        supports={"bottom": ("x", "y", "z")},
    )


@pytest.mark.parametrize(("moment", "warned"), [(0.45, False), (0.9, True)])
def test_rotations_that_are_not_very_small_are_warned_of(moment, warned, caplog):
    with caplog.at_level(logging.WARNING):
        history = fs.simulate(turning(moment))
    assert float(history.rigid_body_rotation.max()) == pytest.approx(2 * moment / 10.0, rel=1e-2)
    text = f"bodies.block.free.rz: the body turned by up to {float(history.rigid_body_rotation.max()):.3g} rad"
    assert (text in caplog.text) == warned


def test_large_rotations_are_refused():
    with pytest.raises(InputError, match=r"bodies.block.free.rz: the body has turned by 0.20\d rad at t = 0.024 s"):
        fs.simulate(turning(1.2))


def test_a_body_turns_by_any_angle_about_one_axis():
    history = fs.simulate(turning(10.0, free=("rz",)))
    assert float(history.rigid_body_rotation.max()) == pytest.approx(2.0, rel=1e-2)
