"""Conditions at contact nodes."""

from __future__ import annotations

import numpy as np

from fingerslip.contact.friction import Conditions


def conditions(**given):
    """Return conditions at which everything that is not given is one."""
    count = len(next(iter(given.values())))
    names = ("pressure", "slip_rate", "slip_since_contact")
    return Conditions(*(np.array(given.get(name, np.ones(count))) for name in names), time=1.0)
