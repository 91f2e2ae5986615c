"""Bodies without inertia that only contact holds: the answer of statics, or a clear refusal."""

import numpy as np
import pytest

import fingerslip as fs
from unit.dynamics.models import DENSITY, GRAVITY, HEIGHT, MODULUS, SIDE, contact, model_of, resting


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
