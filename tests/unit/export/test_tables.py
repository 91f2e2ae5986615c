"""A history as tidy tables."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import fingerslip as fs
from fingerslip.history import VARIABLES


def test_every_record_is_in_a_table(pushed: xr.Dataset) -> None:
    tables = fs.history_tables(pushed)
    assert list(tables) == ["series", "sites", "contact", "counterfaces", "supports"]
    columns = " ".join(column for frame in tables.values() for column in frame.columns)
    missing = [name for name, known in VARIABLES.items() if known.dims[0] == "time" and name not in columns]
    assert all(name.startswith("rigid_body") for name in missing)


def test_a_row_is_a_moment_and_a_site(pushed: xr.Dataset) -> None:
    sites = fs.history_tables(pushed)["sites"]
    assert len(sites) == pushed.sizes["time"] * 2
    low = sites[sites["site"] == "low"]
    assert set(low["site_region"]) == {"bulk"}
    np.testing.assert_array_equal(low["displacement_y_m"], pushed["displacement"].values[:, 1, 1])
    np.testing.assert_array_equal(low["stress_yy_Pa"], pushed["stress"].sel(stress_component="yy").values[:, 1])
    np.testing.assert_array_equal(low["time_s"], pushed["time"].values)


def test_units_are_in_the_names_and_beside_the_table(pushed: xr.Dataset) -> None:
    tables = fs.history_tables(pushed)
    assert tables["counterfaces"].attrs["units"]["counterface_velocity_x_m_per_s"] == "m/s"
    assert "contact_state" in tables["contact"].columns
    assert tables["contact"].attrs["units"]["contact_area_m2"] == "m^2"
    places = tables["contact"].query("time_s == 0")[["contact_position_x_m", "contact_position_y_m"]]
    np.testing.assert_array_equal(places, pushed["contact_position"].values)
    assert "contact_state" not in tables["contact"].attrs["units"]


def test_sums_of_the_contact_table_are_the_forces(pushed: xr.Dataset) -> None:
    tables = fs.history_tables(pushed)
    contact = tables["contact"]
    normal = (contact["normal_traction_Pa"] * contact["contact_area_m2"]).groupby(contact["time_s"]).sum()
    assert normal.to_numpy() == pytest.approx(tables["counterfaces"]["counterface_force_y_N"].to_numpy(), rel=1e-9)
