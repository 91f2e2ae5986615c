"""How the dilatational part of the stiffness is integrated, so that elements do not lock near incompressibility."""

from __future__ import annotations

from typing import Literal

from fingerslip.errors import InputError

#: `selective`: from the mean of each quadrilateral or hexahedron; `full`: at every quadrature point; `nodal`: from the
#: mean around each node, for linear triangles and tetrahedra.
Integration = Literal["selective", "full", "nodal"]

_WITH_MEAN = frozenset({"Q4", "H8"})
LINEAR_SIMPLICES = frozenset({"T3", "T4"})


def is_mean_of_cell(element: str, integration: Integration) -> bool:
    """Tell whether the dilatation of an element, such as ``Q4``, is the mean of each cell."""
    return integration == "selective" and element in _WITH_MEAN


def check_integration(element: str, integration: Integration) -> None:
    """Refuse nodal integration of an element that is no linear triangle or tetrahedron."""
    if integration == "nodal" and element not in LINEAR_SIMPLICES:
        allowed = "needs linear triangles or tetrahedra"
        raise InputError("integration", f"got 'nodal' for {element}", allowed, "write 'selective'")
