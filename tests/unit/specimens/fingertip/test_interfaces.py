"""Depths of the skin's surfaces: fingerprint, ridges, borders of the layers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.specimens.fingertip import interface_depth, preset, surface_depth
from fingerslip.specimens.fingertip.interfaces import fade
from unit.fingers import change


def test_ridges_leave_the_mean_thickness_of_the_epidermis():
    fingertip = preset("wang2014-2d")
    whole_pitches = np.arange(20_000) / 20_000 * 10 * 0.47e-3
    depth = interface_depth(fingertip, whole_pitches)
    assert depth.mean() == pytest.approx(0.5e-3, rel=1e-9)
    assert np.ptp(depth) == pytest.approx(0.15e-3, rel=1e-6)


def test_intermediate_and_limiting_ridges_alternate():
    fingertip, pitch = preset("wang2014-2d"), 0.47e-3
    tips = interface_depth(fingertip, np.array([0.0, 0.5, 1.0, 1.5]) * pitch)
    feet = interface_depth(fingertip, np.array([0.25, 0.75]) * pitch)
    assert tips - feet[0] == pytest.approx([0.15e-3, 0.1e-3, 0.15e-3, 0.1e-3])
    assert feet[1] == pytest.approx(feet[0])


@given(s=st.floats(-8e-3, 5e-3), pitch=st.floats(0.3e-3, 0.8e-3))
def test_ridges_repeat_with_their_pitch(s, pitch):
    fingertip = change(ridges={"pitch": f"{pitch!r} m"})
    here, there = interface_depth(fingertip, np.array([s, s + pitch]))
    assert here == pytest.approx(there, abs=1e-12)


def test_fingerprint_crests_are_above_the_intermediate_ridges():
    fingertip = change(fingerprint={"enabled": True})
    crest, groove = surface_depth(fingertip, np.array([0.0, 0.235e-3]))
    assert (crest, groove) == pytest.approx((-0.05e-3, 0.05e-3))
    shifted = change(fingerprint={"enabled": True, "phase": "180 deg"})
    assert surface_depth(shifted, np.array([0.0]))[0] == pytest.approx(0.05e-3)


def test_ridges_and_ripples_fade_to_nothing_outside_their_zone():
    fingertip = change(fingerprint={"enabled": True})
    outside = np.array([-20e-3, -12e-3, 7e-3, 15e-3])
    assert np.all(surface_depth(fingertip, outside) == 0)
    assert np.all(interface_depth(fingertip, outside) == 0.5e-3)
    assert fade(fingertip.zone, np.array([-11e-3, 0.0, 6e-3])) == pytest.approx(1.0)


def test_layers_without_ridges_and_ripples_are_plain():
    fingertip = change(ridges={"enabled": False})
    s = np.linspace(-10e-3, 5e-3, 50)
    assert np.all(interface_depth(fingertip, s) == 0.5e-3)
    assert np.all(surface_depth(fingertip, s) == 0)


def test_ridges_and_ripples_fade_smoothly_over_their_length():
    """3 x^2 - 2 x^3 of the way in: 0, 5/32, 1/2, 27/32 and 1 at the quarters, the same at both ends."""
    zone = preset("wang2014-2d").zone
    shares = np.array([0.0, 5 / 32, 1 / 2, 27 / 32, 1.0])
    quarters = np.linspace(0.0, 1e-3, 5)
    assert fade(zone, -12e-3 + quarters) == pytest.approx(shares)
    assert fade(zone, 7e-3 - quarters) == pytest.approx(shares)


def test_half_faded_ridges_and_ripples_are_half_as_high():
    """At 6 mm, half a fade from the end of the zone, there are both a crest and the tip of an intermediate ridge."""
    fingertip = change(
        fingerprint={"enabled": True, "pitch": "0.5 mm"},
        ridges={"pitch": "0.5 mm"},
        sagittal={"zone": {"end": "6.5 mm"}},
    )
    here = np.array([2e-3, 6e-3])
    assert surface_depth(fingertip, here) == pytest.approx([-0.05e-3, -0.025e-3])
    assert interface_depth(fingertip, here) - 0.5e-3 == pytest.approx([0.0875e-3, 0.04375e-3])
