"""What laws may depend on, and the frames in which they hold."""

from __future__ import annotations

import numpy as np

from fingerslip.contact.friction import (
    Coulomb,
    PressureDependent,
    SlipWeakening,
    StaticKinetic,
    TangentFrame,
    TimeDependent,
    weakens,
)
from unit.contact.friction.nodes import conditions


def test_isotropic_laws_work_in_the_plane_and_in_space_along_any_tangent():
    laws = (
        Coulomb(0.4),
        StaticKinetic(0.8, 0.3, 2e-3),
        PressureDependent(0.5, 1e4, -1 / 3),
        SlipWeakening(0.8, 0.3, 2e-5),
        TimeDependent((0.0,), (0.5,)),
    )
    for law in laws:
        assert law.dims == (2, 3)
        assert law.frame == TangentFrame(direction=None, stretch=1.0)


def test_conditions_at_some_nodes_keep_the_time():
    given = conditions(pressure=[1.0, 2.0, 3.0], slip_rate=[4.0, 5.0, 6.0], slip_since_contact=[7.0, 8.0, 9.0])
    some = given.at(np.array([True, False, True]))
    assert (some.pressure.tolist(), some.slip_rate.tolist(), some.slip_since_contact.tolist()) == (
        [1, 3],
        [4, 6],
        [7, 9],
    )
    assert some.time == given.time


def test_friction_weakens_where_it_falls_with_slip_or_its_rate():
    assert weakens(StaticKinetic(0.6, 0.5, 1e-3))
    assert weakens(SlipWeakening(0.6, 0.5, 1e-5))
    for law in (
        StaticKinetic(0.6, 0.6, 1e-3),
        StaticKinetic(0.5, 0.6, 1e-3),
        SlipWeakening(0.6, 0.6, 1e-5),
        Coulomb(0.6),
        PressureDependent(0.6, 1e3, -1 / 3),
        TimeDependent((0.0, 1.0), (0.6, 0.5)),
    ):
        assert not weakens(law)
