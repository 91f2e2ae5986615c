"""Which elements take the dilatation from a mean, and which integration they refuse."""

from __future__ import annotations

from typing import get_args

import pytest

from fingerslip.errors import InputError
from fingerslip.fe.integration import Integration, check_integration, is_mean_of_cell

ELEMENTS = ("Q4", "T3", "T6", "H8", "T4", "T10")


def test_selective_integration_is_for_quadrilaterals_and_hexahedra():
    assert [element for element in ELEMENTS if is_mean_of_cell(element, "selective")] == ["Q4", "H8"]
    assert not any(is_mean_of_cell(element, kind) for element in ELEMENTS for kind in ("full", "nodal"))


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("integration", get_args(Integration))
def test_nodal_integration_is_for_linear_simplices(element, integration):
    if integration == "nodal" and element not in ("T3", "T4"):
        with pytest.raises(InputError, match=f"integration: got 'nodal' for {element}, .*; write 'selective'"):
            check_integration(element, integration)
    else:
        check_integration(element, integration)
