"""The result of a run with every value that a result may hold."""

from __future__ import annotations

import dataclasses

from fingerslip.results import result_of
from fingerslip.slip.front import EdgeContact
from unit.synthetic import Process, make

SWEPT = {"contact.friction_coefficient": 0.6, "programme.1.slide.direction": [1, 0, 1]}
MADE = make(Process())
WHOLE = dataclasses.replace(
    result_of(MADE, "run", SWEPT),
    edge=EdgeContact("skin", 0.12, 0.3e-3),
    identity="abc",
    mesh_hash="def",
    mesh_size=0.05,
    seconds=1.5,
    versions={"numpy": "2"},
)
