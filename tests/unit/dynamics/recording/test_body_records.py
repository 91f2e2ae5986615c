"""What histories say of rigid bodies: labels, moments about moving centres, and rotations that move the surface."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fingerslip as fs
from fingerslip.dynamics.recording.body_records import moments
from problems.held import held
from problems.pushed import push_and_slide


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


def test_labels_say_which_body_and_which_axis(history):
    dim = history.sizes["component"]
    assert history.rigid_body.values.tolist() == ["jug"]
    assert history.rotation_axis.values.tolist() == (["z"] if dim == 2 else ["x", "y", "z"])
    np.testing.assert_array_equal(history.rigid_body_centre.values, np.zeros((1, dim)))


def test_the_moment_of_contact_turns_the_body(history):
    """I times the angular acceleration is the applied moment and that of contact about the moved centre."""
    axis = 0 if history.sizes["component"] == 2 else 1
    applied = np.interp(history.time.values, [0.05, 0.1], [0.0, 2e-4])
    inertia = 1e-6 * history.rigid_body_angular_acceleration.values[1:, 0, axis]
    contact = history.rigid_body_moment.values[1:, 0, axis]
    np.testing.assert_allclose(inertia, applied[1:] + contact, atol=1e-9 * 2e-4)
    assert contact[-20:].mean() == pytest.approx(-2e-4, rel=0.2)
    angle = history.rigid_body_rotation.values[:, 0, axis]
    assert 1e-4 < np.abs(angle).max() < 0.1
    rate = np.gradient(angle, history.time.values)
    np.testing.assert_allclose(
        history.rigid_body_angular_velocity.values[2:-2, 0, axis], rate[2:-2], atol=0.1 * np.abs(rate).max()
    )


def test_moments_of_the_body_are_the_opposite_of_those_of_its_faces(history):
    of_faces = history.counterface_moment.values.sum(axis=1)
    np.testing.assert_allclose(history.rigid_body_moment.values[:, 0], -of_faces, atol=1e-15)


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


def test_moments_are_cross_products():
    arms, forces = np.random.default_rng(1).normal(size=(2, 5, 4, 3))
    np.testing.assert_allclose(moments(arms, forces), np.cross(arms, forces))
    flat = moments(arms[..., :2], forces[..., :2])
    arms[..., 2] = forces[..., 2] = 0.0
    np.testing.assert_allclose(flat[..., 0], np.cross(arms, forces)[..., 2])
