"""Gmsh for one mesh: left alone where somebody else uses it; shapes that overlap, and surfaces of rows of points."""

import signal
from pathlib import Path
from unittest.mock import Mock

import gmsh
import numpy as np
import pytest

from fingerslip.errors import MeshError
from fingerslip.mesh.gmsh_session import fragment, generate, gmsh_session, mesh_surface, read_fragments


def test_a_session_ends_with_an_error_too_and_leaves_the_signals_alone():
    """Broken pipes do not end the process after it; who asks is the kernel, where there is one to ask."""
    covered = {"under": (1, 1, 1, 1), "over": (0, 0, 4, 4)}
    with gmsh_session():
        assert gmsh.isInitialized()
        with pytest.raises(MeshError, match="under: is covered by other regions"):
            fragment({name: [rectangle(*sides)] for name, sides in covered.items()}, np.empty((0, 2)), 2)
    with pytest.raises(ZeroDivisionError), gmsh_session():
        raise ZeroDivisionError
    assert not gmsh.isInitialized()
    if (status := Path("/proc/self/status")).exists():
        ignored = next(line for line in status.read_text().splitlines() if line.startswith("SigIgn"))
        assert int(ignored.split()[1], 16) >> (signal.SIGPIPE - 1) & 1


def test_gmsh_that_someone_else_uses_is_left_alone():
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        with pytest.raises(MeshError, match="already initialised"), gmsh_session():
            pass
        assert gmsh.isInitialized()
    finally:
        gmsh.finalize()


def rectangle(x, y, width, height):
    return gmsh.model.occ.addRectangle(x, y, 0.0, width, height)


@pytest.mark.parametrize("quadrilaterals", [False, True])
def test_the_later_region_keeps_what_is_shared(quadrilaterals):
    with gmsh_session():
        shapes = {"outer": [rectangle(0, 0, 4, 2)], "inner": [rectangle(1, 0.5, 2, 1)], "none": []}
        pieces = fragment(shapes, np.array([[2e-3, 1e-3]]), 2)
        generate(2, lambda *_: 0.25e-3, quadrilaterals=quadrilaterals)
        found = read_fragments(pieces, 2, 4 if quadrilaterals else 3)
    corners = found.points[found.cells]
    x, y = corners[..., 0], corners[..., 1]
    area = 0.5 * np.abs(np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1))
    assert [area[found.region == number].sum() for number in (0, 1)] == pytest.approx([6e-6, 2e-6])
    assert np.linalg.norm(found.points - [2e-3, 1e-3], axis=1).min() < 1e-12


def test_pieces_of_a_region_in_3d_become_one_volume_without_faces_inside():
    with gmsh_session():
        boxes = {"under": (0, 0, 0, 4, 4, 2), "over": (0, 0, 1, 4, 4, 3), "rod": (1.5, 1.5, 0.5, 1, 1, 2)}
        shapes = {name: [gmsh.model.occ.addBox(*own)] for name, own in boxes.items()}
        pieces = fragment(shapes, np.array([[2e-3, 2e-3, 2.5e-3]]), 3)
        assert {name: len(own) for name, own in pieces.items()} == {"under": 1, "over": 1, "rod": 1}
        generate(3, lambda *_: 0.5e-3)
        found = read_fragments(pieces, 3, 4)
    corners = found.points[found.cells]
    volume = np.bincount(found.region, np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0)
    assert volume == pytest.approx([15.5e-9, 46.5e-9, 2e-9])
    # Conforming: nodes at one place are one node.
    assert len(np.unique(found.points.round(12), axis=0)) == len(found.points)
    assert np.linalg.norm(found.points - [2e-3, 2e-3, 2.5e-3], axis=1).min() < 1e-12


RADIUS = 5e-3


def ball(first=0.0):
    """Return rows of points from the polar angle `first` round the axis x to the pole at +x."""
    polar = np.linspace(np.pi - first, 0.0, 41)[:, None]
    round_axis = np.linspace(0.0, 2 * np.pi, 49)[None, :-1]
    flat = np.ones_like(round_axis)
    parts = (np.cos(polar) * flat, -np.sin(polar) * np.cos(round_axis), np.sin(polar) * np.sin(round_axis))
    return RADIUS * np.stack(parts, axis=-1)


@pytest.mark.parametrize(("is_open", "size"), [(False, 0.5e-3), (False, 1.5e-3), (True, 1e-3)])
def test_a_ball_and_half_of_it_are_meshed_in_the_wanted_size(is_open, size):
    grid = ball(np.pi / 2 if is_open else 0.0)
    mesh = mesh_surface(grid, is_open, 20, np.full(grid.shape[:2], size))
    points, triangles = mesh.points, mesh.triangles
    normal = np.cross(*(points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2)))
    assert np.sum(normal * points[triangles].mean(axis=1), axis=1).min() > 0.0
    if size <= 1e-3:
        area = np.linalg.norm(normal, axis=1).sum() / 2
        assert area == pytest.approx((2 if is_open else 4) * np.pi * RADIUS**2, rel=0.02)
    # Every edge is used once in either direction, but for those of the rim.
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    directed = {tuple(edge) for edge in edges.tolist()}
    alone = [edge for edge in directed if edge[::-1] not in directed]
    assert len(directed) == 3 * len(triangles)
    assert (len(alone) > 10) == is_open
    assert all(abs(points[node, 0]) < 1e-9 for edge in alone for node in edge)
    length = np.linalg.norm(np.diff(points[edges], axis=1)[:, 0], axis=1)
    assert np.median(length) == pytest.approx(size, rel=0.15)
    for line in (np.abs(points[:, 2]) < 1e-12, np.abs(points[:, 0]) < 1e-12) if not is_open else ():
        assert np.count_nonzero(line) == pytest.approx(2 * np.pi * RADIUS / size, rel=0.15)


def test_failure_of_gmsh_is_ours(monkeypatch):
    monkeypatch.setattr(gmsh.model.mesh, "createGeometry", Mock(side_effect=RuntimeError("no")))
    with pytest.raises(MeshError, match="surface: Gmsh says 'no'"):
        mesh_surface(ball(), False, 20, np.full((41, 48), 1e-3))
