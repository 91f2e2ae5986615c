"""Meshes of every builder lie flat, and are refused once a node of theirs is moved through a facet."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import skfem

import fingerslip as fs
from fingerslip.fe.space import build_space
from fingerslip.mesh.quality import check_folds, turned_cells
from fingerslip.specimens.tactip.tactip import PRESETS, SensorSectionSizes, SensorSolidSizes
from places import ROOT
from unit.ellipsoids import ellipsoid
from unit.fingers import coarse_solid


def section(element: str) -> Any:
    return fs.build_section(fs.preset("wang2014-2d"), bulk_size=0.8e-3, element=element)


def scan() -> Any:
    sizes = fs.LayerSizes(1.2e-3, contact_size=4e-3, bulk_size=6e-3, contact_reach=3e-3, tolerance=0.3e-3, cut=14e-3)
    return fs.build_from_surfaces(ellipsoid(points=400), ellipsoid((7e-3, 3e-3, 3e-3), points=200), sizes)


def sensor_section(element: str) -> Any:
    return SensorSectionSizes(element=element).build(PRESETS.read("tactip-ridged-2d"))


def sensor(element: str, part: str) -> Any:
    changes = {"markers": {"rings": [1, 4]}, "dome": {"radius": "10 mm", "height": "8 mm"}, "part": part}
    small = PRESETS.changed({"preset": "tactip-smooth-3d", **changes})
    return SensorSolidSizes(1e-3, 2e-3, element=element).build(small)


BUILDERS: dict[str, Callable[[], Any]] = {
    **{f"section {element}": functools.partial(section, element) for element in ("Q4", "T3", "T6")},
    "solid T4": coarse_solid,
    "solid T10": lambda: fs.build_solid(fs.preset("wang2014-3d"), contact_size=0.8e-3, bulk_size=1.6e-3),
    "scan": scan,
    **{f"sensor section {element}": functools.partial(sensor_section, element) for element in ("Q4", "T3", "T6")},
    "half of a sensor": functools.partial(sensor, "T4", "half"),
    "whole sensor": functools.partial(sensor, "T10", "whole"),
    "file": lambda: fs.read_mesh(ROOT / "meshes" / "finger_coarse.msh"),
}


# Seconds each; what is in them is in lighter meshes, too.
SECTIONS = ("sensor section T3", "sensor section Q4", "sensor section T6", "section T3")
LONG = ("solid T4", "solid T10", "scan", "half of a sensor", "whole sensor", *SECTIONS)


def folded(mesh: Any) -> Any:
    """Return a mesh with straight cells, one inner vertex of which is where a neighbour's neighbour is."""
    points = mesh.p[:, : mesh.nvertices].copy()
    inner = np.setdiff1d(np.arange(mesh.nvertices), mesh.facets[:, mesh.boundary_facets()])[0]
    around = np.unique(mesh.t[:, (mesh.t == inner).any(axis=0)])
    farthest = around[np.linalg.norm(points[:, around] - points[:, [inner]], axis=0).argmax()]
    points[:, inner] += 1.7 * (points[:, farthest] - points[:, inner])
    kind = {3: skfem.MeshTri1, 4: skfem.MeshTet1}[len(mesh.t)]
    return type(mesh).from_mesh(kind(points, mesh.t)) if type(mesh) is not kind else kind(points, mesh.t)


@pytest.mark.parametrize("name", [pytest.param(one, marks=[pytest.mark.slow] * (one in LONG)) for one in BUILDERS])
def test_meshes_of_builders_lie_flat_and_folded_ones_are_refused(name: str) -> None:
    mesh = BUILDERS[name]()
    check_folds(mesh, turned_cells(mesh))
    build_space(mesh)
    turned = turned_cells(mesh)
    turned[0] = not turned[0]
    with pytest.raises(fs.MeshError, match="fold over each other: 0 and "):
        check_folds(mesh, turned)
    if not isinstance(mesh, skfem.MeshQuad1):  # quadrilaterals keep the order of their corners, and are inverted
        with pytest.raises(fs.MeshError, match="fold over each other"):
            build_space(folded(mesh))
