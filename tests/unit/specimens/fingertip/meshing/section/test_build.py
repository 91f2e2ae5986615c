"""A coarse section has all names; sizes that do not fit and poor cells are refused."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from fingerslip.errors import InputError, MeshError
from fingerslip.specimens.fingertip.meshing.section import build as core_module
from fingerslip.specimens.fingertip.meshing.section.build import mesh_section
from fingerslip.specimens.fingertip.meshing.section.source import MeshSizes, build_section
from unit.fingers import change

PLAIN = change(ridges={"enabled": False})
COARSE = {"contact_size": 0.5e-3, "bulk_size": 1e-3}


@pytest.mark.parametrize("element", ["Q4", "T3", "T6"])
def test_coarse_section_has_all_names_and_the_same_mesh_again(element):
    mesh, again = (build_section(PLAIN, **COARSE, element=element) for _ in range(2))
    assert list(mesh.subdomains) == ["epidermis", "dermis", "tissue", "phalanx"]
    assert {"skin", "pad", "base", "phalanx_base", "dermis_tissue", "phalanx_dorsal"} < set(mesh.boundaries)
    outside = np.concatenate([mesh.boundaries["skin"], mesh.boundaries["base"]])
    assert np.array_equal(np.sort(outside), np.sort(mesh.boundary_facets()))
    assert mesh.doflocs.tobytes() == again.doflocs.tobytes()


def test_sizes_as_a_parameter_set_give_the_same_mesh():
    assert np.array_equal(mesh_section(PLAIN, MeshSizes(**COARSE)).p, build_section(PLAIN, **COARSE).p)


@pytest.mark.parametrize(
    ("groups", "sizes", "message"),
    [
        (
            {},
            {"contact_size": 0.3e-3, "bulk_size": 1e-3},
            "contact_size: got 0.3 mm.*third of ridges.pitch.*'0.1175 mm'",
        ),
        (
            {"ridges": {"enabled": False}, "fingerprint": {"enabled": True}},
            {"contact_size": 0.3e-3, "bulk_size": 1e-3},
            "third of fingerprint.pitch.*switch the fingerprint off",
        ),
        ({}, {"bulk_size": 0.05e-3}, "bulk_size: got 0.05 mm, needs >= 0.12 mm"),
        ({"sagittal": {"zone": {"start": "-20 mm"}}}, {}, "sagittal.zone: reaches from -20 mm to 7 mm"),
    ],
)
def test_sizes_that_do_not_fit_are_one_clear_error(groups, sizes, message):
    with pytest.raises(InputError, match=message):
        build_section(change(**groups), **sizes)


def test_poor_cells_are_refused_with_their_place(monkeypatch):
    good = core_module.mesh_core

    def spoilt(*arguments):
        core = good(*arguments)
        corners = core.points[core.cells["phalanx"][30]]
        core.points[core.cells["phalanx"][30][0]] = corners[2]
        return core

    monkeypatch.setattr(core_module, "mesh_core", spoilt)
    with pytest.raises(
        MeshError, match=r"phalanx cell \d+ at x = .* mm, y = .* mm: .*, needs > .*; write a smaller bulk"
    ):
        build_section(PLAIN, **COARSE)


def test_gmsh_is_loaded_only_where_a_section_is_built() -> None:
    script = (
        "import sys, fingerslip as fs\n"
        "fs.Model, fs.read_mesh, fs.simulate, fs.build_section\n"
        "print(*sorted({'gmsh', 'pygmsh'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
