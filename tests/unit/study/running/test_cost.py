"""What a run costs: time, and memory for its mesh."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from fingerslip.errors import InputError
from fingerslip.study.running.cost import basis_saves, estimated_bytes, estimated_seconds, require_mesh_memory


def test_estimate_grows_with_unknowns_times_steps() -> None:
    small, large = estimated_seconds(10_000, 600), estimated_seconds(20_000, 600)
    assert small == pytest.approx(2.5)
    assert large - small == pytest.approx(2.5e-7 * 10_000 * 600)
    assert estimated_seconds(20_000, 600) == estimated_seconds(10_000, 1200)


def test_runs_in_space_are_known_to_take_longer() -> None:
    """Measured on two cores: the paper's fingertip in 3D took 57 s, a coarse one 16 s."""
    assert estimated_seconds(72_840, 300, dim=3) == pytest.approx(57.0, rel=0.15)
    assert estimated_seconds(19_080, 300, dim=3) == pytest.approx(16.0, rel=0.15)


def source(cells: float | None, element: str | None) -> Any:
    return SimpleNamespace(estimated_cells=lambda _: cells, element=element)


def test_memory_grows_like_the_entries_of_the_cells_matrices() -> None:
    """Measured: assembly of 131,712 linear tetrahedra with nodal integration takes 0.79 GB at its peak."""
    assert estimated_bytes(131_712, "T4") == pytest.approx(0.79e9, rel=0.05)
    assert estimated_bytes(2e4, "T4") == 2 * estimated_bytes(1e4, "T4")
    assert estimated_bytes(1e4, "T10") == pytest.approx(2.5**2 * estimated_bytes(1e4, "T4"))


def test_a_mesh_that_will_not_fit_is_refused_with_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fingerslip.linear.resources.available_memory", lambda: 10**8)
    with pytest.raises(InputError, match=r"memory: .* about 0.6 GB \(assembly of about 1e\+05 tetrahedra 0.6 GB\)"):
        require_mesh_memory(source(1e5, "T4"), None)
    with pytest.raises(InputError, match=r"assembly of about 1e\+06 cells"):
        require_mesh_memory(source(1e6, "Q4"), None)
    require_mesh_memory(source(1e4, "T4"), None)


def test_a_mesh_of_unknown_size_is_let_through(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fingerslip.linear.resources.available_memory", lambda: 1)
    require_mesh_memory(source(None, None), None)


@pytest.mark.parametrize(
    ("case", "saves"),
    [
        ((11_858, 606, 4 * 600, 2), True),  # four runs of the paper's section
        ((11_858, 606, 600, 2), False),  # one of them
        ((70_197, 4_089, 300, 3), False),  # a run of the paper's fingertip in 3D
        ((70_197, 4_089, 64 * 300, 3), True),  # a large sweep of it
        ((70_197, 13_000, 64 * 300, 3), False),  # with a contact three times as fine
    ],
)
def test_a_basis_saves_time_where_many_steps_share_it(case: tuple[int, int, int, int], saves: bool) -> None:
    assert basis_saves(*case) is saves
