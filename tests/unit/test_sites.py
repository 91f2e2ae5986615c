"""Sites are data: naming one loads no mesh code."""

from __future__ import annotations

import subprocess
import sys

import pytest

from fingerslip.errors import InputError
from fingerslip.parameters import as_mapping, from_mapping
from fingerslip.sites import RECEPTOR_KINDS, Site


def test_a_site_is_read_with_units_and_written_back():
    values = {"name": "mine", "kind": "probe", "position": ["0 mm", "-6.5 mm"], "region": "dermis"}
    site = from_mapping(Site, values, "x")
    assert site == Site("mine", "probe", (0.0, -6.5e-3), "dermis")
    assert from_mapping(Site, as_mapping(site), "x") == site


def test_a_position_without_a_unit_is_refused():
    with pytest.raises(InputError, match="has no unit"):
        from_mapping(Site, {"name": "mine", "kind": "probe", "position": [0.0, -6.5]}, "x")


def test_the_four_receptor_kinds():
    assert RECEPTOR_KINDS == ("FA-I", "SA-I", "FA-II", "SA-II")


@pytest.mark.parametrize("module", ["fingerslip.sites", "fingerslip.model.model"])
def test_no_mesh_code_is_loaded(module):
    code = f"import sys, {module}; print([name for name in sys.modules if name.startswith('fingerslip.mesh')])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
