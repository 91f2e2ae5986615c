"""Rigid bodies: Newton's law on their free directions, rotations, what histories say of them, and refusals."""

import dataclasses
import logging

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fingerslip as fs
from fingerslip.errors import EquilibriumError, InputError
from problems.held import GRAVITY, apart, held
from problems.pushed import push_and_slide
from unit.dynamics.models import contact, error_of

FREE = fs.RigidBody(0.02, free=("x", "y"))


@pytest.mark.parametrize("dim", [2, 3])
def test_springs_dampers_and_loads_act_along_each_free_direction(dim):
    """Without inertia c (q_1 - q_0) / h + s q_1 = F in every step, of a body by itself."""
    spring, damper, load, step = 5.0, 7.0, 0.2, 0.1
    free = ("rz", "y") if dim == 2 else ("y", "rx", "ry", "rz")
    body = fs.RigidBody(
        2.0,
        free=free,
        centre=(1.0, 2.0, 3.0)[:dim],
        inertia=(3.0,) * (1 if dim == 2 else 3),
        springs=fs.Springs(**dict.fromkeys(free, spring)),
        dampers=fs.Dampers(**dict.fromkeys(free, damper)),
        loads=(fs.BodyLoad(**dict.fromkeys(free, load)),),
    )
    history = fs.simulate(apart(body, dim, time=fs.QuasiStatic(step, end=1.0)))
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
    driven = fs.Contact("top", fs.Plane((0.0, -1.0), offset=-2.0), drive=fs.Drive(mass=0.02, force=0.04))
    history = fs.simulate(apart(FREE, bodies={}, contacts=(driven,), damping=damping))
    fallen *= 2.0 / GRAVITY
    np.testing.assert_allclose(history.counterface_displacement.values[:, 0, 1], fallen, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("element", ["Q4", "T6", "H8"])
def test_two_fingers_hold_an_object_by_friction_alone(element):
    history = fs.simulate(held(element, time=fs.TimeStepping(2e-3, end=0.2)))
    last, weight = history.isel(time=-1), 0.02 * GRAVITY
    # The fingers ring a little; the mean over the last half of the run does not.
    force = history.rigid_body_force.values[50:, 0]
    np.testing.assert_allclose(force.mean(axis=0)[-1], weight, rtol=0.05)
    np.testing.assert_allclose(last.rigid_body_force.values[0], -last.counterface_force.values.sum(axis=0), atol=1e-15)
    used, is_symmetric = history.friction_utilisation.values, element != "T6"  # whose cells lean to the same side
    np.testing.assert_allclose(used[:, 0], used[:, 1], atol=1e-9 if is_symmetric else 0.1)
    assert 0.0 < used[-1, 0] < 1.0
    if is_symmetric:
        assert np.abs(force[:, :-1]).max() < 1e-9 * weight
        assert np.abs(last.rigid_body_displacement.values[0, :-1]).max() < 1e-12
    imbalance = np.abs(history.energy_imbalance.values).max()
    assert imbalance < 1e-9 * np.abs(history.external_work.values).max()


@pytest.mark.slow
def test_newtons_law_holds_for_the_body_in_every_step_and_a_load_beyond_friction_has_no_equilibrium():
    """The trapezoidal rule takes the equations of motion at the end of each step as they are."""
    history = fs.simulate(held(time=fs.TimeStepping(1e-3, alpha=0.0, end=0.2)))
    filled = np.interp(history.time.values, [0.05, 0.1], [0.0, 1.0])
    inertia = 0.02 * history.rigid_body_acceleration.values[1:, 0]
    forces = history.rigid_body_force.values[1:, 0] + np.outer(filled[1:], [0.0, -0.02 * GRAVITY])
    np.testing.assert_allclose(inertia, forces, atol=1e-9 * np.abs(forces).max())
    model = held(time=fs.QuasiStatic(5e-3, end=0.2), gravity=None, body=_loaded(-5.0))
    with pytest.raises(EquilibriumError, match=r"contact alone does not hold the rigid body 'jug' \(x, y\)"):
        fs.simulate(model)


def _loaded(force):
    return dataclasses.replace(FREE, loads=(fs.BodyLoad(y=force, ramp=fs.Ramp((0.05, 0.1), (0.0, 1.0))),))


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
    history = fs.simulate(push_and_slide(contacts=contact(rigid_body="table"), bodies={"table": body}, programme=()))
    assert history.phase_kind.values.tolist() == ["press", "hold"]
    moved = history.rigid_body_displacement.values[:, 0]
    np.testing.assert_allclose(moved[:, 1], np.interp(history.time, [0.0, 0.1, 0.2], [0.0, 0.4e-3, 0.4e-3]), atol=1e-15)
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
    ("body", "counterface"),
    [
        pytest.param(TURNING, DISC, id="turning", marks=pytest.mark.slow),
        pytest.param(SPRUNG, fs.Plane(), id="sprung"),
        pytest.param(dataclasses.replace(SPRUNG, dampers=fs.Dampers(y=0.5)), fs.Plane(), id="damped"),
    ],
)
def test_a_reduced_basis_moves_the_body_as_the_mesh_does(body, counterface):
    on_table = {"contacts": contact(counterface=counterface, rigid_body="table"), "bodies": {"table": body}}
    model = push_and_slide(**on_table, programme=(), time=fs.TimeStepping(1e-3, end=0.1))
    full, reduced = (fs.simulate(dataclasses.replace(model, basis=own)) for own in (None, fs.ReducedBasis()))
    assert reduced.attrs["basis"] == "reduced"
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


@pytest.mark.slow
@pytest.mark.parametrize(("dim", "element", "up", "about"), [(2, "Q4", "y", "rz"), (3, "H8", "z", "ry")])
def test_the_moment_of_contact_turns_the_body(dim, element, up, about):
    """An object, heavier on one side, turns between the fingers until friction holds it.

    I times the angular acceleration is the applied moment and that of contact about the moved centre.
    """
    turn = fs.BodyLoad(**{about: 2e-4}, ramp=fs.Ramp((0.05, 0.1), (0.0, 1.0)))
    inertia = (1e-6,) * (1 if dim == 2 else 3)
    body = fs.RigidBody(0.02, free=(up, about), centre=(0.0,) * dim, inertia=inertia, loads=(turn,))
    history = fs.simulate(held(element, body=body, gravity=None, time=fs.TimeStepping(1e-3, alpha=0.0, end=0.12)))
    axes = ["z"] if dim == 2 else ["x", "y", "z"]
    axis = axes.index("z" if dim == 2 else "y")
    assert history.rigid_body.values.tolist() == ["jug"]
    assert history.rotation_axis.values.tolist() == axes
    np.testing.assert_array_equal(history.rigid_body_centre.values, np.zeros((1, dim)))
    moments = history.rigid_body_moment.values[:, 0]
    np.testing.assert_allclose(moments, -history.counterface_moment.values.sum(axis=1), atol=1e-15)
    applied = np.interp(history.time.values, [0.05, 0.1], [0.0, 2e-4])
    inertia = 1e-6 * history.rigid_body_angular_acceleration.values[1:, 0, axis]
    np.testing.assert_allclose(inertia, (applied + moments[:, axis])[1:], atol=1e-9 * 2e-4)
    assert moments[-20:, axis].mean() == pytest.approx(-2e-4, rel=0.2)
    angle = history.rigid_body_rotation.values[:, 0, axis]
    assert 1e-4 < np.abs(angle).max() < 0.1
    rate = np.gradient(angle, history.time.values)[2:-2]
    computed = history.rigid_body_angular_velocity.values[2:-2, 0, axis]
    np.testing.assert_allclose(computed, rate, atol=0.1 * np.abs(rate).max())
    # The normal of a flat face turns with the body: friction has no part along it.
    angles = np.zeros((history.sizes["time"], 3))
    angles[:, 2 if dim == 2 else slice(None)] = history.rigid_body_rotation.values[:, 0].squeeze()
    turned = Rotation.from_rotvec(angles).as_matrix()[:, :dim, :dim]
    normals = history.counterface_normal.values[history.contact_counterface.values]
    along = np.einsum("tcd,tde,ce->tc", history.tangential_traction.values, turned, normals)
    assert np.abs(along).max() < 1e-9 * history.normal_traction.values.max()


def test_a_round_object_without_friction_turns_as_if_nothing_touched_it():
    """Its surface moves along itself, so that neither gaps nor forces change, up to the square of the angle."""
    round_ = contact(counterface=fs.Cylinder(20e-3, centre=(0.0, -20e-3)), friction=fs.Coulomb(0.0), rigid_body="disc")
    still = fs.RigidBody(1e-3, centre=(0.0, -20e-3), inertia=(1e-6,), programme=(fs.Press(0.2e-3, 4e-3), fs.Hold(0.05)))
    turned, at_rest = (
        fs.simulate(
            push_and_slide(contacts=round_, bodies={"disc": body}, programme=(), time=fs.TimeStepping(1e-3, alpha=0.0))
        )
        for body in (dataclasses.replace(still, free=("rz",), loads=(fs.BodyLoad(rz=1e-5),)), still)
    )
    angle = turned.rigid_body_rotation.values[:, 0, 0]
    np.testing.assert_allclose(angle, 0.5 * 1e-5 / 1e-6 * turned.time.values**2, rtol=1e-2)
    force = at_rest.counterface_force.values[:, 0, 1]
    np.testing.assert_allclose(turned.counterface_force.values[:, 0, 1], force, atol=5e-3 * force.max())


def turning(moment, *, free=("ry", "rz")):
    """Return a body by itself that turns by twice the static angle at most."""
    springs, loads = fs.Springs(**dict.fromkeys(free, 10.0)), (fs.BodyLoad(rz=moment),)
    return apart(fs.RigidBody(1.0, free, centre=(0.0, 2.0, 0.0), inertia=(1e-3,) * 3, springs=springs, loads=loads), 3)


@pytest.mark.parametrize(("moment", "warned"), [(0.45, False), (0.9, True)])
def test_rotations_about_several_axes_that_are_not_very_small_are_warned_of(moment, warned, caplog):
    """About one axis they may be any; larger ones about several are refused."""
    with caplog.at_level(logging.WARNING):
        history = fs.simulate(turning(moment))
    assert float(history.rigid_body_rotation.max()) == pytest.approx(2 * moment / 10.0, rel=1e-2)
    text = f"bodies.block.free.rz: the body turned by up to {float(history.rigid_body_rotation.max()):.3g} rad"
    assert (text in caplog.text) == warned
    about_one = fs.simulate(turning(20.0 * moment, free=("rz",)))
    assert float(about_one.rigid_body_rotation.max()) == pytest.approx(4.0 * moment, rel=1e-2)
    with pytest.raises(InputError, match=r"bodies.block.free.rz: the body has turned by 0.20\d rad at t = 0.024 s"):
        fs.simulate(turning(1.2))
