"""The contact penalties of a model."""

from __future__ import annotations

import numpy as np

from fingerslip.contact.candidates import automatic_penalty
from fingerslip.model.model import Contact, Model

__all__ = ["contact_penalties"]


def contact_penalties(model: Model, contact: Contact) -> tuple[float, float]:
    """Return normal and tangential penalty of a contact [Pa/m].

    Without given values, they follow from the stiffest material under the boundary and the size of its facets.
    """
    mesh = model.mesh
    facets = np.asarray(mesh.boundaries[contact.boundary])
    cells = mesh.f2t[0, facets]
    # A mesh may name further groups of cells that have no material of their own.
    touched = [name for name in model.materials if np.isin(cells, mesh.subdomains[name]).any()]
    stiffness = max(model.materials[name].stiffness for name in touched)
    ends = mesh.p[:, mesh.facets[:2, facets]]
    size = float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=0)))
    automatic = automatic_penalty(stiffness, size)
    return contact.normal_penalty or automatic, contact.tangential_penalty or automatic
