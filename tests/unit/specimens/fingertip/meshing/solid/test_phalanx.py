"""The phalanx in 3D as triangles: sizes that follow the tissue around it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fingerslip.specimens.fingertip import phalanx_surface
from fingerslip.specimens.fingertip.meshing.solid import build as phalanx_module
from fingerslip.specimens.fingertip.meshing.solid.build import mesh_phalanx
from fingerslip.specimens.fingertip.meshing.solid.source import SolidSizes
from fingerslip.specimens.fingertip.skin import below_skin, skin_grid
from unit.fingers import change_solid


def test_triangles_are_fine_near_the_contact_and_never_wider_than_the_tissue(monkeypatch: pytest.MonkeyPatch) -> None:
    finger, sizes = change_solid(), SolidSizes("T4", contact_size=0.4e-3, bulk_size=2e-3)
    given = {}

    def keep(grid, is_open, divide_at, wanted):
        given.update(grid=grid, is_open=is_open, divide_at=divide_at, wanted=wanted)

    monkeypatch.setattr(phalanx_module, "mesh_surface", keep)
    skin = skin_grid(finger).reshape(-1, 3)
    inner = below_skin(finger, skin, finger.layers.skin_thickness)
    surface = phalanx_surface(finger)
    mesh_phalanx(finger, surface, sizes, SimpleNamespace(points=inner[None]))
    assert given["is_open"]
    assert given["grid"] is surface.points
    assert surface.points[given["divide_at"], 0, 0] == pytest.approx(0.0)
    tissue = np.linalg.norm(surface.points[::6, ::6, None] - inner[None, None, ::20], axis=-1).min(axis=-1)
    wanted = given["wanted"][::6, ::6]
    assert np.all(wanted >= sizes.contact_size)
    assert np.all(wanted <= np.maximum(0.75 * tissue, sizes.contact_size))
    palmar, dorsal = wanted[:, 0], wanted[:, wanted.shape[1] // 2]
    assert palmar.mean() < dorsal.mean()
