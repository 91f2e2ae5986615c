"""The bar of a simulation: drawn where it is asked for, and nothing else."""

from __future__ import annotations

import pytest

import fingerslip as fs
from fingerslip.dynamics.progress import shown_progress
from problems.pushed import push_and_slide


def test_what_is_given_receives_the_fractions() -> None:
    got: list[float] = []
    with shown_progress(got.append) as told:
        assert told is not None
        told(0.5)
    assert got == [0.5]


@pytest.mark.parametrize("nothing", [None, False])
def test_nothing_is_shown_unless_asked_for(nothing: bool | None, capsys: pytest.CaptureFixture[str]) -> None:
    with shown_progress(nothing) as told:
        assert told is None
    assert capsys.readouterr().err == ""


def test_a_bar_goes_to_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    history = fs.simulate(push_and_slide(), progress=True)
    assert history.sizes["time"] > 1
    printed = capsys.readouterr()
    assert "100 %" in printed.err
    assert printed.out == ""
