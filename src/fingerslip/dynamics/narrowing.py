"""Candidates chosen in two stages: few at first, all that may touch where these were too few.

In 3D the contact nodes decide what a simulation costs: memory and products grow with the square of their number,
the inverse of their Schur complement with its cube. A boundary seldom touches further out than the counterface goes,
while the search of :mod:`fingerslip.dynamics.system.checks` reaches half as far again. So the first stage searches a
quarter further than the counterface goes. Every step tells whether a node outside reaches the counterface; if one does,
the simulation begins again with all candidates. The motion is the same in both.
"""

from __future__ import annotations

from dataclasses import replace

from fingerslip.dynamics.system.bodies import contact_motion
from fingerslip.dynamics.system.motion import largest_approach
from fingerslip.errors import InputError
from fingerslip.model.model import Contact, Model

__all__ = ["with_short_search"]

# Search distance of the first stage over the approach of the counterface. Measured on the shipped fingertip pressed by
# 2 mm: 0.91 in the press, up to 1.18 after 5 mm of slide in eight directions, as the pad rolls across. Too short a
# search costs all steps up to where that shows.
_NEAR = 1.25


def with_short_search(model: Model) -> Model:
    """Return a model in 3D whose automatic search for candidates is short; any other model as it is."""
    if model.mesh.dim() == 2 or model.is_loaded:
        return model
    contacts = tuple(_with_reach(model, number) for number in range(len(model.contacts)))
    same = all(contact is other for contact, other in zip(contacts, model.contacts, strict=True))
    return model if same else replace(model, contacts=contacts)


def _with_reach(model: Model, number: int) -> Contact:
    contact = model.contacts[number]
    if contact.search_distance is not None:
        return contact
    try:
        approach = largest_approach(contact_motion(model, number), contact.counterface)
    except InputError:
        # The checks of the model say what is wrong, and where.
        return contact
    return replace(contact, search_distance=_NEAR * approach) if approach > 0.0 else contact
