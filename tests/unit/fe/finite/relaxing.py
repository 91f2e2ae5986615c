"""Bodies at large strain that relax, and steps of them."""

from __future__ import annotations

from dataclasses import replace

from fingerslip.materials.prony import PronyTerm
from unit.fe.finite.bodies import LAWS, SOFT, body, moved

TERMS = (PronyTerm(0.3, 0.1), PronyTerm(0.25, 0.4))
RELAXING = tuple(replace(law, prony=TERMS) for law in LAWS)
STEP = 0.05


def relaxing_body(kind, law=RELAXING[0], **others):
    """Return a body whose near half relaxes and whose far half is elastic."""
    return body(*kind, law=law, **({"beside": SOFT} | others))


def stepped(bulk, steps=3, amount=0.03, step=STEP):
    """Return a body after some random steps."""
    state = bulk.at_rest(step)
    for number in range(steps):
        begun = bulk.begun(state, step)
        state = bulk.ended(bulk.deformed(moved(bulk, amount, 10 + number), begun))
    return state
