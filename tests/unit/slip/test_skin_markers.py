"""Order of slip at the skin's markers, and cycles of stick and slip."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.slip.skin_markers import share_before_centre, skin_marker_slips, stick_slip_cycles

TIMES = np.linspace(0.0, 10.0, 101)


def history(friction=None, lags=(1.0, 3.0, 2.0)):
    """Return a history of three markers that follow a plate at 1 mm/s until they lag from given times on."""
    plate = np.column_stack([1e-3 * TIMES, 0.0 * TIMES])
    moved = np.stack([np.column_stack([1e-3 * np.minimum(TIMES, lag), 0.0 * TIMES]) for lag in lags], axis=1)
    force = np.column_stack([TIMES if friction is None else friction, np.ones(101)])
    rest = np.array([[-1e-3, 0.0], [0.0, 0.0], [1e-3, 0.0]])
    return xr.Dataset(
        {
            "displacement": (("time", "site", "component"), moved),
            "counterface_displacement": (("time", "counterface", "component"), plate[:, None]),
            "counterface_force": (("time", "counterface", "component"), force[:, None]),
            "contact_state": (("time", "contact_node"), np.ones((101, 3), dtype=int)),
        },
        coords={
            "time": TIMES,
            "site": ["external-marker-1-02", "external-marker-0-01", "external-marker-1-01"],
            "site_kind": ("site", ["external marker"] * 3),
            "site_position": (("site", "component"), rest),
            "counterface_normal": (("counterface", "component"), [[0.0, 1.0]]),
            "contact_position": (("contact_node", "component"), rest),
            "phase_kind": ("phase", ["slide"]),
            "phase_start": ("phase", [0.0]),
            "phase_end": ("phase", [10.0]),
        },
    )


def test_times_at_which_markers_lag():
    slips = skin_marker_slips(history())
    # 50 um behind a plate at 1 mm/s.
    assert slips.time == pytest.approx([1.05, 3.05, 2.05])
    assert share_before_centre(slips) == 1.0


def test_a_centre_that_slips_in_between():
    assert share_before_centre(skin_marker_slips(history(lags=(1.0, 2.0, 20.0)))) == 0.5


def test_without_markers_there_is_nothing():
    assert skin_marker_slips(history().assign_coords(site_kind=("site", ["probe"] * 3))) is None


def test_a_saw_tooth_has_its_cycles():
    assert stick_slip_cycles(history(np.mod(TIMES, 2.6))) == 3
    assert stick_slip_cycles(history(np.minimum(TIMES, 3.0))) == 0


def test_small_falls_are_noise():
    ripple = np.minimum(TIMES, 3.0) + 0.05 * np.sin(20 * TIMES)
    assert stick_slip_cycles(history(ripple)) == 0
