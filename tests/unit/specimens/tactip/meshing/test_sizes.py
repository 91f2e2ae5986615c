"""Element sizes grow from the skin and the rods into the gel."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.specimens.tactip.meshing.sizes import size_at_rods, size_function
from fingerslip.specimens.tactip.meshing.source import SensorSectionSizes
from fingerslip.specimens.tactip.tactip import PRESETS


def test_sizes_at_skin_rod_gel_and_far_away():
    sensor, sizes = PRESETS.read("tactip-smooth-2d"), SensorSectionSizes(0.3e-3, 2e-3)
    size = size_function(sensor, sizes, np.array([[[0.0, 0.5e-3], [0.0, 3e-3]]]), size_at_rods(sensor))
    assert size(3e-3, 0.6e-3, 0.0) == pytest.approx(0.3e-3)
    assert size(0.0, 2.5e-3, 0.0) == pytest.approx(0.3e-3)
    assert 0.3e-3 < size(4e-3, 4e-3, 0.0) < 2e-3
    assert size(0.0, 18e-3, 0.0) == pytest.approx(2e-3)
    assert size(19.5e-3, 19e-3, 0.0) == pytest.approx(0.6e-3, rel=0.1)
