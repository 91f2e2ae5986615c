"""Forces of supports, and supports that move: statics, momentum, energy and closed forms."""

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import mass_matrix
from fingerslip.fe.space import build_space
from problems.pushed import push_and_slide
from unit.dynamics.models import assert_same_history, model_of, supported_block

DOWN_AND_ASIDE = fs.SupportMotion((-0.8e-3, -0.4e-3), fs.Ramp((0.0, 0.1, 0.2), (0.0, 0.5, 1.0)))
STATIC = fs.QuasiStatic(5e-3)
HOLDS_STILL = {"programme": (), "contacts": (fs.Contact("bottom", friction=fs.Coulomb(0.4)),)}


@pytest.mark.parametrize("dim", [2, 3])
def test_a_support_carries_weight_and_loads(dim):
    up = np.eye(dim)[-1]
    history = fs.simulate(supported_block(dim, gravity=tuple(-9.81 * up), tractions={"bottom": tuple(-50.0 * up)}))
    area = 10e-3 if dim == 2 else 10e-3**2
    expected = 1000.0 * 9.81 * area * 5e-3 + 50.0 * area
    assert history.support.values.tolist() == ["top"]
    np.testing.assert_allclose(history.support_force.values[-1, 0], expected * up, rtol=1e-10, atol=1e-10 * expected)


def test_supports_share_what_they_carry_and_what_two_hold_moves_with_the_first():
    """The sides carry half of the pull each, and what both hold counts for the first of them.

    The corner belongs to the left side, which rests; the rest of the top moves down.
    """
    held = {"left": ("x", "y"), "right": ("x", "y"), "bottom": ("x",)}
    history = fs.simulate(supported_block(supports=held, tractions={"top": (0.0, 100.0)}))
    forces = history.support_force.values[-1]
    np.testing.assert_allclose(forces[:, 1], [-0.5, -0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(forces[:, 0].sum(), 0.0, atol=1e-12)
    down = fs.SupportMotion((0.0, -1e-3), fs.Ramp((0.0, 0.2), (0.0, 1.0)))
    moving = {"supports": {"left": ("y",), "top": ("x", "y")}, "support_motions": {"top": down}}
    history = fs.simulate(supported_block(**moving, record=fs.Recording(snapshots_every=0.2)))
    x, y = history.node_position.values.T
    moved = history.snapshot_displacement.values[-1, y > 5e-3 - 1e-9, 1]
    np.testing.assert_allclose(moved, np.where(x[y > 5e-3 - 1e-9] < 1e-9, 0.0, -1e-3), atol=1e-15)


@pytest.mark.parametrize("basis", [None, fs.ReducedBasis()])
def test_supports_and_plate_are_in_balance_in_quasi_static_steps(basis):
    history = fs.simulate(push_and_slide(time=fs.QuasiStatic(5e-3), basis=basis))
    total = history.support_force.values[:, 0] + history.counterface_force.values[:, 0]
    assert np.abs(total).max() <= 1e-9 * np.abs(history.counterface_force.values).max()
    assert history.attrs["basis"].startswith("full" if basis is None else "reduced")


def steps_before_a_release(history):
    """Return how many steps there are before a node leaves, or friction turns: then forces at the start are dropped."""
    touches, friction = history.contact_state.values > 0, history.tangential_traction.values[..., 0]
    changes = (touches[:-1] & ~touches[1:]) | (friction[:-1] * friction[1:] < 0.0)
    return int(np.argmax([*changes.any(axis=1), True]))


@pytest.mark.parametrize("alpha", [0.0, -0.05, -0.41421])
@pytest.mark.parametrize(
    ("motions", "of_mass"), [({}, 0.0), ({"top": DOWN_AND_ASIDE}, 0.0), ({"top": DOWN_AND_ASIDE}, 2.0)]
)
def test_momentum_is_balanced_by_the_weights_of_the_scheme_and_energy_by_its_terms(alpha, motions, of_mass):
    """Summed up over the whole mesh: (M a)_1 = (1 + alpha) P_1 - alpha P_0 with all forces P from outside.

    Also where a support drags the body over a plate. Damping by the mass is one of these forces; then the first step,
    which takes up what damping by the stiffness lacks at the start, is left out.
    """
    changes = {"support_motions": motions, "gravity": (1.0, -2.0), "damping": fs.RayleighDamping(of_mass, 1e-4)}
    if motions:
        changes |= HOLDS_STILL | {"time": fs.TimeStepping(5e-3, alpha, end=0.3)}
    model = push_and_slide(alpha=alpha, **changes)
    space = build_space(model.mesh)
    matrix = mass_matrix(space, cell_materials(space, model.materials, model.formulation), model.depth)
    masses = np.asarray(matrix.sum(axis=0)).reshape(-1, 2)
    nodes = tuple(fs.Site(str(number), "", tuple(point)) for number, point in enumerate(space.positions))
    history = fs.simulate(dataclasses.replace(model, record=fs.Recording(nodes)))
    rate = (history.acceleration.values * masses).sum(axis=1)
    outside = history.support_force.values[:, 0] + history.counterface_force.values[:, 0]
    outside += masses.sum() / 2 * np.array(model.gravity)
    outside -= model.damping.mass * (history.velocity.values * masses).sum(axis=1)
    expected = (1.0 + alpha) * outside[1:] - alpha * outside[:-1]
    first, count = 1 + bool(of_mass), steps_before_a_release(history)
    assert count > 10
    np.testing.assert_allclose(rate[first:count], expected[first - 1 : count - 1], atol=1e-9 * np.abs(outside).max())
    work = float(history.external_work.values.max())
    assert np.abs(history.energy_imbalance.values).max() <= 1e-11 * work
    assert float(history.friction_dissipation[-1]) > 0.1 * work
    assert (history.contact_state.values[-1] > 0).sum() > 3


def test_moving_the_support_is_moving_the_plate_the_other_way_and_the_whole_mesh_shows_it():
    """Statics does not know which of the two moves."""
    contact = fs.Contact("bottom", friction=fs.Coulomb(0.4), search_distance=1.0)
    plate = push_and_slide(time=STATIC, programme=(fs.Press(0.4e-3, 4e-3),), contacts=(contact,))
    path = fs.SupportMotion((0.0, -0.4e-3), fs.Ramp((0.0, 0.1), (0.0, 1.0)))
    moved = dataclasses.replace(plate, programme=(), time=fs.QuasiStatic(5e-3, end=0.1), support_motions={"top": path})
    one, other = fs.simulate(plate), fs.simulate(moved)
    names = ("normal_traction", "tangential_traction", "gap", "slip_distance", "strain_energy", "external_work")
    assert_same_history(other[[*names]], one[[*names]], 1e-10)
    shift = one.contact_displacement.values - other.contact_displacement.values
    np.testing.assert_allclose(shift[-1], [[0.0, 0.4e-3]] * shift.shape[1], atol=1e-15)
    record = fs.Recording(sites=(fs.Site("held", "", (0.0, 4e-3)),), snapshots_every=0.1)
    still = {"time": fs.QuasiStatic(5e-3, end=0.2), "support_motions": {"top": DOWN_AND_ASIDE}}
    history = fs.simulate(push_and_slide(**HOLDS_STILL, **still, record=record))
    np.testing.assert_allclose(history.displacement.values[-1, 0], [-0.8e-3, -0.4e-3], rtol=1e-12)
    top = history.node_position.values[:, 1] > 4e-3 - 1e-9
    np.testing.assert_allclose(history.snapshot_displacement.values[-1, top], [[-0.8e-3, -0.4e-3]] * top.sum())


def test_a_base_that_sets_off_makes_a_bar_swing():
    """One cell of a bar with consistent mass: x = v t - 1.5 v/omega sin(omega t), omega^2 = 3 E/(rho L^2).

    The base starts at once with v; the free end's mass is rho A L/3, and rho A L/6 couples it to the base. 400 steps a
    period see the start at a step's length: 1 %.
    """
    length, modulus, density, speed = 1.0, 1e6, 1000.0, 0.1
    rotation = (3.0 * modulus / density) ** 0.5 / length
    period = 2.0 * np.pi / rotation
    end = period
    history = fs.simulate(
        model_of(
            "Q4",
            [0.0, length],
            [0.0, 0.1],
            materials={"bulk": fs.Elastic(modulus, 0.0, density)},
            formulation="plane_stress",
            supports={"left": ("x",), "bulk": ("y",)},
            support_motions={"left": fs.SupportMotion((speed * end, 0.0), fs.Ramp((0.0, end), (0.0, 1.0)))},
            time=fs.TimeStepping(period / 400, 0.0, end=end),
            record=fs.Recording(sites=(fs.Site("end", "", (length, 0.0)),)),
        )
    )
    time = history.time.values
    exact = speed * time - 1.5 * speed / rotation * np.sin(rotation * time)
    assert np.abs(history.displacement.values[:, 0, 0] - exact).max() <= 0.01 * 1.5 * speed / rotation
    energy = (history.kinetic_energy + history.strain_energy - history.external_work).values
    assert np.abs(energy).max() <= 1e-11 * np.abs(history.external_work.values).max()


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_forces_so_far_are_those_of_the_whole_run(kinematics):
    model = push_and_slide(kinematics=kinematics, materials={"bulk": fs.NeoHookean(50e3, 0.45, 1000.0)})
    whole = fs.simulate(model).support_force.values
    assert np.abs(whole).max() > 0.0
    with fs.Simulation(model) as sim:
        for taken in range(1, 30):
            sim.step()
            if taken % 7 == 0:
                np.testing.assert_array_equal(sim.history().support_force.values, whole[: taken + 1])
