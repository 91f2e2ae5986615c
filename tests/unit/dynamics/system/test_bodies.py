"""Free directions of rigid bodies: the motion that they add, Newton's law on them, and bodies that cannot be."""

from __future__ import annotations

import dataclasses
import logging

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.system.bodies import contact_motion, rigid_freedoms
from fingerslip.dynamics.system.checks import check_model
from fingerslip.errors import EquilibriumError, InputError
from problems.held import GRAVITY, MU, apart, held
from problems.pushed import push_and_slide

FREE = fs.RigidBody(0.02, free=("x", "y"))


def test_drives_come_first_and_a_free_body_is_an_unknown_for_each_direction():
    contacts = (
        fs.Contact("bottom", rigid_body="table"),
        fs.Contact("left", fs.Plane((1.0, 0.0)), drive=fs.Drive(0.1, 0.5)),
        fs.Contact("right", fs.Plane((-1.0, 0.0)), rigid_body="table"),
    )
    body = fs.RigidBody(
        mass=2.0,
        free=("rz", "y"),
        centre=(1.0, 2.0),
        inertia=(3.0,),
        springs=fs.Springs(rz=5.0),
        dampers=fs.Dampers(y=7.0),
        loads=(fs.BodyLoad(y=1.0, rz=4.0),),
    )
    model = push_and_slide(contacts=contacts, bodies={"table": body}, gravity=(1.0, -9.81))
    drive, along, about = rigid_freedoms(model)
    assert (drive.body, drive.faces, drive.mass, drive.loads[0][0]) == (None, (1,), 0.1, 0.5)
    assert (along.body, along.direction, along.faces, along.mass) == ("table", "y", (0, 2), 2.0)
    assert [value for value, _ in along.loads] == [1.0, pytest.approx(-2.0 * 9.81)]
    assert (about.direction, about.mass, about.stiffness, about.damping) == ("rz", 3.0, 5.0, 0.0)
    assert [value for value, _ in about.loads] == [4.0]
    points = np.array([[1.0, 2.0], [4.0, 2.0], [1.0, 3.0]])
    np.testing.assert_array_equal(about.moved(points), [[0, 0], [0, 3], [-1, 0]])
    np.testing.assert_array_equal(along.moved(points), [[0, 1]] * 3)


def test_rotations_in_space_are_cross_products():
    axes = ("rx", "ry", "rz")
    body = fs.RigidBody(1.0, free=axes, centre=(1.0, 2.0, 3.0), inertia=(1.0, 2.0, 3.0))
    model = held("H8", body=body)
    points = np.random.default_rng(0).normal(size=(4, 3))
    for axis, freedom in zip(np.eye(3), rigid_freedoms(model), strict=True):
        np.testing.assert_allclose(freedom.moved(points), np.cross(axis, points - [1.0, 2.0, 3.0]), atol=1e-15)
    assert [freedom.mass for freedom in rigid_freedoms(model)] == [1.0, 2.0, 3.0]


def test_material_damping_leaves_rigid_bodies_alone():
    """With the trapezoidal rule, a body by itself falls exactly, whatever damps the material."""
    history = fs.simulate(apart(FREE, gravity=(0.0, -GRAVITY), damping=fs.RayleighDamping(mass=30.0, stiffness=1e-3)))
    fallen = -0.5 * GRAVITY * history.time.values**2
    np.testing.assert_allclose(history.rigid_body_displacement.values[:, 0, 1], fallen, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(history.rigid_body_acceleration.values[:, 0], [[0.0, -GRAVITY]] * 101, rtol=1e-9)


def test_material_damping_leaves_a_driven_counterface_alone():
    """It falls freely onto a block that it does not reach."""
    contact = fs.Contact("top", fs.Plane((0.0, -1.0), offset=-2.0), drive=fs.Drive(mass=0.02, force=0.04))
    damping = fs.RayleighDamping(mass=30.0, stiffness=1e-3)
    history = fs.simulate(apart(FREE, bodies={}, contacts=(contact,), damping=damping))
    fallen = -0.5 * 2.0 * history.time.values**2
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
    motion = contact_motion(model, 0)
    np.testing.assert_allclose(motion.positions[-1], [0.0, 0.4e-3])
    history = fs.simulate(model)
    assert history.phase_kind.values.tolist() == ["press", "hold"]
    moved = history.rigid_body_displacement.values[:, 0]
    np.testing.assert_allclose(moved[:, 1], motion.displacement(history.time.values)[:, 1], atol=1e-15)
    np.testing.assert_array_equal(moved, history.counterface_displacement.values[:, 0])
    np.testing.assert_allclose(history.rigid_body_velocity.values[10, 0, 1], 4e-3)
    assert np.abs(moved[:, 0]).max() < 1e-12, "the pad is symmetric"


def test_motions_with_other_loads_are_computed_together():
    models = [held(gravity=None, body=_loaded(force)) for force in (-0.1, -0.2)]
    together = fs.simulate_together(models)
    for model, history in zip(models, together, strict=True):
        alone = fs.simulate(model)
        np.testing.assert_allclose(
            history.rigid_body_displacement.values, alone.rigid_body_displacement.values, atol=1e-12
        )
    heavier = held(gravity=None, body=dataclasses.replace(_loaded(-0.1), mass=1.0))
    with pytest.raises(InputError, match=r"models.1.bodies: differs from that of the first model"):
        fs.simulate_together([models[0], heavier])


@pytest.mark.parametrize("dampers", [None, fs.Dampers(y=0.5)])
def test_a_reduced_basis_moves_the_body_as_the_mesh_does(dampers, caplog):
    """Springs and masses are part of the basis; dampers are not, so that the motion is computed on the mesh."""
    body = fs.RigidBody(1e-3, free=("y",), springs=fs.Springs(y=5.0), loads=(fs.BodyLoad(y=0.01),), dampers=dampers)
    contact = fs.Contact("bottom", friction=fs.Coulomb(0.4), rigid_body="table")
    changes = {"contacts": (contact,), "bodies": {"table": body}, "programme": ()}
    model = push_and_slide(**changes, time=fs.TimeStepping(1e-3, end=0.1))
    with caplog.at_level(logging.WARNING):
        reduced = fs.simulate(dataclasses.replace(model, basis=fs.ReducedBasis()))
    full = fs.simulate(model).rigid_body_displacement.values
    np.testing.assert_allclose(reduced.rigid_body_displacement.values, full, atol=1e-4 * np.abs(full).max())
    assert reduced.attrs["basis"] == ("full" if dampers else "reduced")
    assert ("rigid bodies have other damping than the material" in caplog.text) == bool(dampers)


def test_a_turning_body_moves_in_a_reduced_basis_as_on_the_mesh():
    body = fs.RigidBody(
        1e-3,
        free=("y", "rz"),
        centre=(0.0, -2e-3),
        inertia=(1e-8,),
        springs=fs.Springs(rz=1e-3),
        loads=(fs.BodyLoad(y=0.01, rz=2e-5),),
    )
    contact = fs.Contact("bottom", fs.Cylinder(20e-3, centre=(0.0, -20e-3)), fs.Coulomb(0.4), rigid_body="table")
    model = push_and_slide(
        contacts=(contact,), bodies={"table": body}, programme=(), time=fs.TimeStepping(1e-3, end=0.1)
    )
    full, reduced = (fs.simulate(dataclasses.replace(model, basis=basis)) for basis in (None, fs.ReducedBasis()))
    assert reduced.attrs["basis"] == "reduced"
    for name in ("rigid_body_displacement", "rigid_body_rotation", "counterface_force"):
        scale = np.abs(full[name].values).max()
        assert scale > 0.0
        np.testing.assert_allclose(reduced[name].values, full[name].values, atol=1e-3 * scale)


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
