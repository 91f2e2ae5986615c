"""The fingerprint on the skin in 3D."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.specimens.fingertip import depth_below_skin, phalanx_surface
from fingerslip.specimens.fingertip.meshing.solid import sweep_solid_skin
from fingerslip.specimens.fingertip.meshing.sources import SolidSizes
from unit.fingers import change_solid

RIPPLED = change_solid(fingerprint={"enabled": True})


def test_fingerprint_is_on_the_contact_and_leaves_the_dermis_alone():
    sizes = SolidSizes("T4", contact_size=0.117e-3, bulk_size=1.6e-3, contact_reach=0.12e-3)
    skin = sweep_solid_skin(RIPPLED, sizes, phalanx_surface(RIPPLED).points.reshape(-1, 3))
    depth = depth_below_skin(RIPPLED, skin.points[0])
    low = skin.points[0][:, 1] < -6.5e-3 + 0.09e-3
    assert depth[low].min() == pytest.approx(-0.05e-3, rel=0.1)
    assert depth[low].max() == pytest.approx(0.05e-3, rel=0.1)
    assert np.abs(depth[skin.points[0][:, 1] > -6.3e-3]).max() < 4e-6
    dermis = int(np.abs(skin.levels - 0.5e-3).argmin())
    inside = skin.points[0][:, 0] > -12e-3
    assert np.allclose(depth_below_skin(RIPPLED, skin.points[dermis][inside]), 0.5e-3, atol=1e-5)
