"""Steps: their number, which of them are kept whole, and that too many are refused before they take memory."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.dynamics.recording import steps
from fingerslip.dynamics.recording.steps import record_bytes, snapshot_steps, step_count, step_times
from fingerslip.dynamics.system.checks import check_model
from problems.pushed import push_and_slide

SITES = (fs.Site("a", "FA-I", (0.0, 1e-3)), fs.Site("b", "SA-I", (1e-3, 2e-3)))


def test_steps_go_on_until_the_end_is_reached():
    model = push_and_slide(step=7e-3)
    assert step_count(model) == 32
    assert step_times(model) == pytest.approx(7e-3 * np.arange(33))


@pytest.mark.parametrize("every", [0.0, 0.02, 1e-4])
@pytest.mark.parametrize("element", ["Q4", "T6"])
def test_estimated_records_take_what_the_history_takes(every: float, element: str):
    model = push_and_slide(element, record=fs.Recording(SITES, snapshots_every=every))
    history = fs.simulate(model)
    taken = sum(variable.nbytes for variable in history.data_vars.values())
    estimated = record_bytes(model, history.sizes.get("node", 0) or 45, history.sizes["contact_node"])
    assert taken <= estimated < 1.3 * taken


def nearest(times, interval):
    """Return what compares every time with every multiple."""
    wanted = np.append(np.arange(0.0, times[-1], interval), times[-1])
    return sorted(set(np.abs(times[:, None] - wanted).argmin(axis=0).tolist()))


@given(st.integers(1, 60), st.sampled_from([1e-3, 5e-3, 0.1]), st.floats(0.3, 70.0))
def test_snapshots_are_at_the_nearest_steps(count: int, step: float, ratio: float):
    times = step * np.arange(count + 1)
    assert snapshot_steps(times, ratio * step) == nearest(times, ratio * step)


def test_tiny_intervals_keep_every_step_and_take_no_memory():
    assert snapshot_steps(np.linspace(0.0, 3.0, 11), 1e-12) == list(range(11))
    assert snapshot_steps(np.linspace(0.0, 3.0, 11), 0.0) == []


def test_records_of_controlled_steps_are_counted_and_refused_before_there_are_any():
    model = push_and_slide(time=fs.Adaptive(5e-3, records_per_decade=10, end=100.0))
    assert step_times(model).size == step_count(model) + 1 < 150
    with pytest.raises(fs.InputError, match=r"time\.output: .* GB are available"):
        step_times(push_and_slide(time=fs.Adaptive(1e-12)))


@pytest.mark.parametrize("check", [fs.simulate, check_model, step_times])
def test_too_many_steps_are_refused_with_the_estimate_and_the_step_to_write(check):
    message = (
        r"time.step: 2.2e\+11 steps of 1e-12 s need about .* GB for their records, .* GB are available; "
        r"write a step of at least .* s, record fewer sites"
    )
    with pytest.raises(fs.InputError, match=message):
        check(push_and_slide(step=1e-12))


def test_too_many_snapshots_are_refused(monkeypatch):
    few, many = push_and_slide(), push_and_slide(record=fs.Recording(snapshots_every=1e-3))
    between = (record_bytes(few, 45, 9) + record_bytes(many, 45, 9)) // 2
    monkeypatch.setattr(steps, "available_memory", lambda: between)
    check_model(few)
    with pytest.raises(fs.InputError, match=r"GB for their records, .* GB are available; .*or take fewer snapshots"):
        check_model(many)
