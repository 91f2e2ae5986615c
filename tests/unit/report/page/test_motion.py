"""Runs in motion as plain data: the body, the slip map and the signals."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from fingerslip.report.page.motion import language, run_motion
from fingerslip.report.page.packing import unpack_arrays
from fingerslip.slip import Events, SlipEvents
from unit.report.scenes import block_history
from unit.synthetic import Process, make


@pytest.fixture(scope="module")
def plane() -> xr.Dataset:
    return block_history("Q4")


def summed(frames: np.ndarray) -> np.ndarray:
    """Undo the differences between frames as the page does."""
    return np.cumsum(frames, axis=0, dtype=frames.dtype)


def test_section_moves_as_its_snapshots_do(plane: xr.Dataset) -> None:
    motion = run_motion(plane, Events(), "a title")
    arrays, body = unpack_arrays(motion), motion["body"]
    assert body["frames"] == pytest.approx(plane["snapshot_time"].values.tolist())
    places = arrays["points"] * body["unit"] + summed(arrays["moved"]) * body["movedUnit"]
    expected = 1e3 * (plane["node_position"].values + plane["snapshot_displacement"].values)
    np.testing.assert_allclose(places, expected, atol=2e-3)
    stress = summed(arrays["stress"]) * body["top"] / 255.0
    shown = np.minimum(1e-3 * plane["snapshot_von_mises"].values, body["top"])
    np.testing.assert_allclose(stress, shown, atol=body["top"] / 255.0)
    assert [region["name"] for region in body["regions"]] == ["skin", "tissue"]
    assert body["travels"] == 1.0
    assert len(body["plates"][0]) == 1
    json.dumps(motion)


def test_a_run_without_snapshots_has_no_body_and_its_events_are_named() -> None:
    history = make(Process())
    motion = run_motion(history, Events(slip=SlipEvents(incipient=1.2, overall=1.7)), "t")
    assert motion["body"] is None
    assert [event["name"] for event in motion["events"]] == ["incipient", "overall"]
    arrays = unpack_arrays(motion)
    assert arrays["states"].shape == (arrays["times"].size, arrays["along"].size)
    assert [panel["label"] for panel in motion["panels"]][:2] == ["force [N]", "ratio, fraction"]
    for panel in motion["panels"]:
        assert all(arrays[line["array"]].size == arrays["times"].size for line in panel["lines"])


def test_the_snapshots_nearest_to_events_are_among_the_frames(
    monkeypatch: pytest.MonkeyPatch, plane: xr.Dataset
) -> None:
    monkeypatch.setattr("fingerslip.report.page.motion._FRAMES", 2)
    assert run_motion(plane, Events(), "t")["body"]["frames"] == [0.05, 0.1]
    motion = run_motion(plane, Events(slip=SlipEvents(incipient=0.01)), "t")
    assert motion["body"]["frames"] == [0.0, 0.05, 0.1]


def test_solid_has_triangles_and_its_states() -> None:
    history = block_history("T4")
    motion = run_motion(history, Events(), "t")
    arrays = unpack_arrays(motion)
    assert motion["solid"]
    assert arrays["triangles"].max() < len(arrays["points"])
    assert set(np.unique(arrays["vertexState"])) <= {0, 1, 2, 255}
    assert {0, 1} <= set(np.unique(arrays["triangleCut"]))


@pytest.mark.parametrize("element", ["Q4", "T4"])
def test_the_phalanx_does_not_set_the_colours(element: str) -> None:
    history = block_history(element)
    soft = run_motion(history, Events(), "t")["body"]
    stress = history["snapshot_von_mises"].where(history["cell_region"] == 0, 1e9)
    bone = history.assign(snapshot_von_mises=stress).assign_attrs(regions="skin, phalanx")
    body = run_motion(bone, Events(), "t")["body"]
    assert body["top"] <= 1e-3 * float(stress.where(stress < 1e9).max())
    assert "phalanx may exceed" in body["field"]
    assert "phalanx" not in soft["field"]


def test_colours_of_a_solid_reach_what_is_drawn() -> None:
    """Its vertices have means over cells, which are smaller than what single cells have."""
    history = block_history("T4")
    motion = run_motion(history, Events(), "t")
    assert summed(unpack_arrays(motion)["stress"]).max() == 255
    assert (summed(unpack_arrays(motion)["stress"]) == 255).mean() < 0.01


def test_language_has_a_colour_for_each_state_and_a_map() -> None:
    found = language()
    assert len(found["states"]) == len(found["stateNames"]) == 3
    assert len(found["map"]) == 33
