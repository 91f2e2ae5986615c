"""Forces of supports, supports that move, and bodies without inertia that only contact holds."""

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import mass_matrix
from fingerslip.fe.space import build_space
from problems.pushed import push_and_slide
from unit.dynamics.models import (
    DENSITY,
    GRAVITY,
    HEIGHT,
    MODULUS,
    SIDE,
    assert_same_history,
    contact,
    model_of,
    resting,
    supported_block,
)

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


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    ("gap", "pull", "ratio", "supports"),
    [
        (0.0, 0.0, 0.0, {}),
        (3e-3, 0.0, 0.0, {}),
        (0.1e-3, 0.0, 0.0, {"left": ("x",)}),
        (0.0, 40.0, 0.0, {}),
        (0.0, 40.0, 0.45, {}),
    ],
)
def test_a_block_rests_on_the_springs_of_its_contact_and_friction_carries_a_pull(dim, gap, pull, ratio, supports):
    """Without Poisson's effect, the pressure is uniform, and the plate gives way by pressure over penalty."""
    history = fs.simulate(resting(dim, gap=gap, pull=pull, poisson_ratio=ratio, supports=supports))
    pressure, side = DENSITY * GRAVITY * HEIGHT, 1.0 if dim == 2 else SIDE
    force, weight = history["counterface_force"].values[1:, 0], pressure * SIDE * side
    np.testing.assert_allclose(force[:, -1], weight, rtol=1e-8 if pull else 1e-9)
    np.testing.assert_allclose(force[-1, 0], -pull * HEIGHT * side, rtol=1e-8, atol=1e-9 * weight)
    if not pull:
        penalty = 10 * MODULUS / (SIDE / 8)
        np.testing.assert_allclose(history["gap"].values[1:], -pressure / penalty, rtol=1e-6)
        assert np.abs(force[:, :-1]).max() < 1e-9 * weight
    imbalance = np.abs(history["energy_imbalance"].values).max()
    assert imbalance < 1e-9 * np.abs(history["external_work"].values).max()


def test_the_answer_is_that_of_slow_dynamics():
    """A block in a heavily damped fall ends where statics puts it at once."""
    damped = fs.simulate(
        resting(poisson_ratio=0.3, time=fs.TimeStepping(2e-3, end=1.0), damping=fs.RayleighDamping(mass=100.0))
    ).isel(time=-1)
    static = fs.simulate(resting(poisson_ratio=0.3)).isel(time=-1)
    largest = np.abs(static["normal_traction"].values).max()
    np.testing.assert_allclose(damped["normal_traction"].values, static["normal_traction"].values, atol=1e-3 * largest)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_plate_carries_a_free_block_along(dim):
    travel = 2e-3
    slide = (fs.Hold(0.05), fs.Slide(travel, travel / 0.1, direction=tuple(np.eye(dim)[0])))
    history = fs.simulate(resting(dim, programme=slide, time=fs.QuasiStatic(0.01)))
    np.testing.assert_allclose(history["contact_displacement"].values[-1, :, 0], travel, rtol=1e-6)
    assert (history["contact_state"].values[-1] == 1).all()


@pytest.mark.parametrize(
    "changes", [{"pull": 50.0}, {"gravity": (0.0, 9.81)}], ids=["a pull beyond friction", "a lift"]
)
def test_loads_that_contact_does_not_carry_are_refused_and_with_inertia_move_the_body(changes):
    with pytest.raises(fs.EquilibriumError, match=r"equilibrium at t = 0.1 s: contact alone does not hold the body"):
        fs.simulate(resting(**changes))
    flying = fs.simulate(resting(**changes, contacts=(), time=fs.TimeStepping(1e-3, end=0.01)))
    assert flying["kinetic_energy"].values[-1] > 0.0


@pytest.mark.parametrize("mass", [1e-3, 1e-9, 1e-18])
def test_the_mass_of_a_body_does_not_matter_without_inertia(mass):
    """A plate that presses a pad with 0.1 N, pad and plate of any mass."""
    pad, plate = (fs.simulate(_pressed(of_pad=own, of_plate=other)) for own, other in ((mass, 1.0), (1.0, mass)))
    usual = fs.simulate(_pressed())
    assert usual["counterface_force"].values[-1, 0, 1] == pytest.approx(0.1, rel=1e-9)
    for history in (pad, plate):
        moved = history["rigid_body_displacement"].values[-1, 0, 1]
        assert moved == pytest.approx(usual["rigid_body_displacement"].values[-1, 0, 1], rel=1e-9)


def _pressed(*, of_pad=1.0, of_plate=1.0):
    """Return a pad between a plate that rests and one that 0.1 N press on it; only contact holds both."""
    below = contact(counterface=fs.Plane((0.0, 1.0)))
    above = contact(boundary="top", counterface=fs.Plane((0.0, -1.0)), rigid_body="plate")
    plate = fs.RigidBody(of_plate, free=("y",), loads=(fs.BodyLoad(y=-0.1),))
    material, none = fs.Elastic(MODULUS, 0.3, DENSITY * of_pad), {"gravity": None, "tractions": {}}
    return resting(contacts=below + above, materials={"bulk": material}, bodies={"plate": plate}, **none)


@pytest.mark.parametrize("spring", [100.0, 1.0])
def test_a_cylinder_rolls_on_a_pad_until_its_spring_holds_it(spring):
    """A spring along the pad is all that resists the roll, far softer than the contact.

    The softest yields to the facets of the pad, between which the cylinder finds its place.
    """
    radius = 10e-3
    loads = fs.BodyLoad(y=-1.0), fs.BodyLoad(rz=1e-6 * spring, ramp=fs.Ramp((0.1, 0.3), (0.0, 1.0)))
    cylinder = fs.RigidBody(
        1.0, ("x", "y", "rz"), centre=(0.0, radius), inertia=(1e-4,), springs=fs.Springs(x=spring), loads=loads
    )
    face = fs.Cylinder(radius, centre=(0.0, radius))
    model = model_of(
        "Q4",
        np.linspace(-4e-3, 4e-3, 17),
        np.linspace(-2e-3, 0.0, 5),
        materials={"bulk": fs.Elastic(MODULUS, 0.0, DENSITY)},
        depth=10e-3,
        supports={"bottom": ("x", "y")},
        contacts=contact(boundary="top", counterface=face, friction=fs.Coulomb(0.8), rigid_body="cylinder"),
        bodies={"cylinder": cylinder},
        time=fs.QuasiStatic(0.1, end=0.3),
    )
    history = fs.simulate(model).isel(time=-1)
    moved, force = history["rigid_body_displacement"].values[0], history["rigid_body_force"].values[0]
    assert moved[0] < -1e-6 or spring < 10.0
    np.testing.assert_allclose(force, [spring * moved[0], 1.0], rtol=1e-8)
