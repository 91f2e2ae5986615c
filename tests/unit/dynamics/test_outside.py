"""Nodes that are no candidates must not reach a counterface, whether states are checked one by one or together."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.outside import OutsideCheck
from fingerslip.dynamics.step.state import first_state
from fingerslip.dynamics.system.coordinates import MeshCoordinates
from fingerslip.dynamics.system.system import build_system
from problems.pushed import push_and_slide
from problems.verification.reference import make_stepper

MODEL = push_and_slide(contacts=(fs.Contact("bottom", search_distance=1e-6),))


class OneAtOnce(MeshCoordinates):
    checks_at_once = 1


class SeveralAtOnce(MeshCoordinates):
    checks_at_once = 3


def raised(height):
    """Return a state in which the counterface has come nearer [m]."""
    return dataclasses.replace(first_state(make_stepper(MODEL)), counterfaces=np.array([[0.0, height]]), time=height)


def checking(kind):
    system = build_system(MODEL)
    return OutsideCheck(dataclasses.replace(system, coordinates=kind(system.unknowns, system.space.n_dofs)))


def test_states_can_be_checked_one_by_one():
    check = checking(OneAtOnce)
    check.look(raised(1e-9))
    with pytest.raises(fs.SlipOutsideContactError, match=r"t = 0.001 s: node \d+ .* is no contact candidate"):
        check.look(raised(1e-3))


def test_several_states_are_checked_together_and_the_rest_at_the_end():
    check = checking(SeveralAtOnce)
    check.look(raised(1e-3))
    check.look(raised(2e-3))
    with pytest.raises(fs.SlipOutsideContactError, match=r"t = 0.001 s"):
        check.look(raised(1e-9))
    check.finish()
    check.look(raised(1e-3))
    with pytest.raises(fs.SlipOutsideContactError, match=r"t = 0.001 s"):
        check.finish()
