"""The fingerprint in 3D: along the finger that of the section, none on the back."""

from __future__ import annotations

import dataclasses

import numpy as np

from fingerslip.specimens.fingertip import outline_curve, relief_depth, surface_depth
from unit.fingers import change_solid

FINGER = change_solid(fingerprint={"enabled": True})


def test_middle_line_has_the_ripples_of_the_section():
    curve = outline_curve(dataclasses.replace(FINGER, section="sagittal"))
    s = np.linspace(-11e-3, 6e-3, 500)
    x, y = (np.interp(s, curve.arc_length, column) for column in curve.points.T)
    relief = relief_depth(FINGER, np.column_stack([x, y, np.zeros_like(x)]))
    assert np.allclose(relief, surface_depth(FINGER, s), atol=1e-9)
    assert np.ptp(relief) > 0.09e-3


def test_back_and_sides_are_smooth():
    places = np.array([[0.0, 6.5e-3, 0.0], [0.0, 1e-4, 8e-3], [0.0, -1e-4, -8e-3]])
    assert not relief_depth(FINGER, places).any()
    assert not relief_depth(change_solid(), np.array([[0.0, -6.5e-3, 0.0]])).any()
