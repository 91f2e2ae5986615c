"""A block pressed and dragged: it sticks until the shear force reaches mu N, and bears exactly that from there on.

Source: Coulomb's law. With uniform shear, in closed form, it is the problem `dragged-block` of `fingerslip verify`.
"""

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.verification.blocks import block_on_plate
from problems.blocks import ELEMENTS

WIDTH, HEIGHT, DEPTH, MODULUS, MU = 10e-3, 4e-3, 1e-3, 34e3, 0.5


def block(element, programme, *, density=1e-3, penalty=1e9, friction=MU, time=None, **changes):
    return block_on_plate(
        element,
        *(np.linspace(0, WIDTH, 11), np.linspace(0, HEIGHT, 5)),
        material=fs.Elastic(MODULUS, 0.4, density),
        plate={"friction": fs.Coulomb(friction), "normal_penalty": penalty, "tangential_penalty": penalty},
        depth=DEPTH,
        supports={"top": ("x", "y")},
        programme=programme,
        time=time or fs.TimeStepping(2e-3),
        **changes,
    )


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_soft_block_drags_at_exactly_mu(element):
    """With edges that slip first: F / N rises, never passes mu, and is mu to rounding once all nodes slip."""
    history = fs.simulate(block(element, (fs.Press(0.2e-3, 2e-3), fs.Slide(6e-3, 20e-3)), density=1000.0))
    force, state = history.counterface_force.values[1:, 0], history.contact_state.values[1:]
    ratio, touching = force[:, 0] / force[:, 1], state > 0
    assert (np.abs(ratio) <= MU * (1 + 1e-12)).all()
    assert ratio[-1] == pytest.approx(MU, rel=1e-12)
    same_way = (history.tangential_traction.values[1:, :, 0] >= 0).all(axis=1)
    overall = ((state != 1) & touching.any(axis=1, keepdims=True)).all(axis=1) & same_way
    sliding = history.time.values[1:] > 0.1 + 1e-9
    assert np.abs(ratio[overall & sliding] - MU).max() <= 1e-12
    partly = sliding & (state == 1).any(axis=1)
    assert partly.sum() > 10
    assert (ratio[partly] < MU).all()


@pytest.mark.parametrize("element", ["Q4", pytest.param("T6", marks=pytest.mark.slow)])
def test_a_stuck_contact_does_not_creep(element):
    """Held for 2000 steps under a shear below mu N, it keeps force and place: the law has a true stick state."""
    programme = (fs.Press(0.2e-3, 2e-3), fs.Slide(0.1e-3, 2e-3), fs.Hold(2.0))
    history = fs.simulate(block(element, programme, time=fs.TimeStepping(1e-3), friction=1.0))
    held = history.isel(time=slice(-1900, None))
    assert (held.contact_state.values != 0).any(axis=1).all()
    assert (held.contact_state.values == 1).any(axis=1).all()
    for name, scale in (
        ("contact_displacement", 0.1e-3),
        ("counterface_force", float(held.counterface_force[0, 0, 0])),
    ):
        drift = np.abs(held[name].values - held[name].values[0]).max()
        assert drift <= 1e-9 * scale, f"{name} drifts by {drift / scale:.1e}"


@pytest.mark.parametrize(("alpha", "stiffness"), [(0.0, 0.0), (-0.05, 0.0), (-1 / 3, 0.0), (-0.05, 2e-3)])
def test_energy_balance_of_a_press_and_slide(alpha, stiffness):
    """Every term is computed by itself, so 1e-9 of the external work is rounding; friction only takes.

    Damping takes du . C v with the mean velocity, of which du is not the h-fold in ringing that the step does not
    resolve: at the end of it 1e-12 of the work may come back.
    """
    programme = (fs.Press(0.4e-3, 2e-3), fs.Slide(4e-3, 10e-3), fs.Lift(0.6e-3, 5e-3))
    time, damping = fs.TimeStepping(2e-3, alpha), fs.RayleighDamping(stiffness=stiffness)
    history = fs.simulate(block("Q4", programme, density=1000.0, penalty=1e8, time=time, damping=damping))
    work = np.abs(history.external_work.values).max()
    assert np.abs(history.energy_imbalance.values).max() <= 1e-9 * work
    assert (np.diff(history.friction_dissipation.values) >= -1e-15 * work).all()
    assert float(history.friction_dissipation[-1]) > 0.3 * work
    assert (np.diff(history.damping_dissipation.values) >= -1e-12 * work).all()
    assert (float(history.damping_dissipation[-1]) > 0.0) == (stiffness > 0.0)
    assert not history.contact_state.values[-1].any(), "the plate has been lifted off"
