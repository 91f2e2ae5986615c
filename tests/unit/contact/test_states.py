"""The states of contact nodes, and where histories say what they mean."""

from __future__ import annotations

from fingerslip import history
from fingerslip.contact.states import OPEN, SLIP, STICK


def test_histories_store_the_states_as_these_numbers():
    assert (OPEN, STICK, SLIP) == (0, 1, 2)
    assert history.VARIABLES["contact_state"].long_name == "0 open, 1 stick, 2 slip"
    assert (history.OPEN, history.STICK, history.SLIP) == (OPEN, STICK, SLIP)
