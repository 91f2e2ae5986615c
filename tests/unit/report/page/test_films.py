"""A film as data."""

from __future__ import annotations

import dataclasses

import pytest
import xarray as xr

from fingerslip.report.page.films import Film


def test_a_film_is_frozen():
    film = Film("run", "internal", xr.Dataset(), xr.Dataset(), {"rms": None}, {})
    with pytest.raises(dataclasses.FrozenInstanceError):
        film.kind = "external"
