"""Counterfaces of rows of points as triangles: closed, turned outwards, of the wanted size, nodes on the lines."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import MeshError
from fingerslip.mesh import patches
from fingerslip.mesh.patches import mesh_surface

RADIUS = 5e-3


def ball(first=0.0):
    """Return rows of points from the polar angle `first` round the axis x to the pole at +x."""
    polar = np.linspace(np.pi - first, 0.0, 41)[:, None]
    round_axis = np.linspace(0.0, 2 * np.pi, 49)[None, :-1]
    flat = np.ones_like(round_axis)
    parts = (np.cos(polar) * flat, -np.sin(polar) * np.cos(round_axis), np.sin(polar) * np.sin(round_axis))
    return RADIUS * np.stack(parts, axis=-1)


def edges(triangles):
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


@pytest.mark.parametrize("is_open", [False, True])
def test_ball_and_half_of_it(is_open):
    grid = ball(np.pi / 2 if is_open else 0.0)
    mesh = mesh_surface(grid, is_open, 20, np.full(grid.shape[:2], 1e-3))
    points, triangles = mesh.points, mesh.triangles
    normal = np.cross(*(points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2)))
    assert np.sum(normal * points[triangles].mean(axis=1), axis=1).min() > 0.0
    area = np.linalg.norm(normal, axis=1).sum() / 2
    assert area == pytest.approx((2 if is_open else 4) * np.pi * RADIUS**2, rel=0.02)
    # Every edge is used once in either direction, but for those of the rim.
    one_way = {tuple(edge) for edge in edges(triangles).tolist()}
    alone = [edge for edge in one_way if edge[::-1] not in one_way]
    assert len(one_way) == 3 * len(triangles)
    assert (len(alone) > 10) == is_open
    assert all(abs(points[node, 0]) < 1e-9 for edge in alone for node in edge)


@pytest.mark.parametrize("size", [0.5e-3, 1.5e-3])
def test_sizes_are_kept_and_nodes_lie_on_the_lines(size):
    grid = ball()
    mesh = mesh_surface(grid, False, 20, np.full(grid.shape[:2], size))
    length = np.linalg.norm(np.diff(mesh.points[edges(mesh.triangles)], axis=1)[:, 0], axis=1)
    assert np.median(length) == pytest.approx(size, rel=0.15)
    for line in (np.abs(mesh.points[:, 2]) < 1e-12, np.abs(mesh.points[:, 0]) < 1e-12):
        assert np.count_nonzero(line) == pytest.approx(2 * np.pi * RADIUS / size, rel=0.15)


def test_failure_of_gmsh_is_ours(monkeypatch):
    def fail(*_):
        raise RuntimeError("no")

    monkeypatch.setattr(patches.gmsh.model.mesh, "createGeometry", fail)
    with pytest.raises(MeshError, match="surface: Gmsh says 'no'"):
        mesh_surface(ball(), False, 20, np.full((41, 48), 1e-3))
