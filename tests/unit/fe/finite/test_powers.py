"""Laws of all points at once: they are the laws of the materials, and a law of a user's own is taken as it is."""

from dataclasses import dataclass

import numpy as np
import pytest

from fingerslip.errors import FingerslipError
from fingerslip.fe.finite.powers import laws_of_points
from fingerslip.materials.neo_hookean import NeoHookean
from unit.fe.finite.bodies import EVERY_PAIR, LAWS, SOFT, body, moved


@dataclass(frozen=True)
class Own:
    """A law that says nothing of powers."""

    law: object

    def __getattr__(self, name):
        if name == "sum_of_powers":
            raise AttributeError(name)
        return getattr(self.law, name)


class Locking(NeoHookean):
    """A law that is derived from one of powers, with another stress beyond a strain."""

    def kirchhoff_stress(self, log_strain):
        return super().kirchhoff_stress(log_strain) + 1e6 * np.maximum(log_strain - 0.5, 0.0)


class Softer(NeoHookean):
    """Another, with another tangent."""

    def kirchhoff_tangent(self, log_strain):
        return 0.5 * super().kirchhoff_tangent(log_strain)


class Named(NeoHookean):
    """One that is derived without functions of its own."""


@EVERY_PAIR
def test_a_body_is_that_of_the_laws_of_its_materials(element, integration, formulation, law):
    pairs = (law, SOFT), (Own(law), Own(SOFT))
    bodies = [body(element, integration, formulation, law=near, beside=far) for near, far in pairs]
    at = moved(bodies[0], 0.03)
    states = [bulk.deformed(at, bulk.deformed(0.9 * at)) for bulk in bodies]
    some = np.arange(states[0].log_strain.shape[0])[1::3]
    for read in (
        lambda bulk, state: bulk.force(state),
        lambda bulk, state: bulk.energy(state),
        lambda bulk, state: bulk.tangent(state).toarray(),
        lambda bulk, state: bulk.energy_densities(state, some),
    ):
        values, expected = map(read, bodies, states)
        np.testing.assert_allclose(values, expected, rtol=0.0, atol=1e-10 * np.abs(expected).max())


def test_a_law_of_its_own_is_no_sum_of_powers():
    number = np.array([0, 1, 0])
    assert laws_of_points([SOFT, *LAWS, Named(34e3, 0.48, 1000.0)], number) is not None
    for law in (Own(SOFT), Locking(34e3, 0.48, 1000.0), Softer(34e3, 0.48, 1000.0)):
        assert laws_of_points([SOFT, law], number) is None


def test_a_thickness_that_is_not_found_is_an_error_with_the_name_of_the_law():
    bulk = body("Q4", formulation="plane_stress", law=SOFT)
    nothing = np.zeros(bulk.space.n_dofs)
    near = bulk.deformed(nothing)
    near.log_strain[:, 2] = np.nan
    with pytest.raises(FingerslipError, match="NeoHookean: no thickness"):
        bulk.deformed(nothing, near)
