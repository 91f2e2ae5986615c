from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.detect.features import entropy, rigid_residual, strains
from fingerslip.errors import InputError
from fingerslip.marker_layouts import ring_layout

REST = ring_layout(1.0).position
NUMBER = st.floats(-1, 1)


@given(NUMBER, NUMBER, NUMBER)
def test_a_rigid_motion_leaves_nothing(x: float, y: float, turn: float) -> None:
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    moved = np.array([x, y]) + REST @ rotation.T - REST
    assert rigid_residual(REST, moved[None]) == pytest.approx(0.0, abs=1e-12)
    divergence, shear = strains(REST, moved[None])
    assert divergence == pytest.approx(2.0 * np.cos(turn) - 2.0, abs=1e-9)
    assert shear == pytest.approx(0.0, abs=1e-9)


@given(st.lists(NUMBER, min_size=4, max_size=4))
def test_strains_of_an_affine_motion_are_exact(gradient: list[float]) -> None:
    matrix = np.array(gradient).reshape(2, 2)
    divergence, shear = strains(REST, (REST @ matrix.T)[None])
    green = 0.5 * (matrix + matrix.T + matrix.T @ matrix)
    assert divergence == pytest.approx(np.trace(matrix), abs=1e-9)
    assert shear == pytest.approx(np.ptp(np.linalg.eigvalsh(green)) / 2, abs=1e-9)


def test_the_residual_of_partial_slip_is_what_slipped() -> None:
    moved = np.zeros((1, len(REST), 2))
    moved[0, np.linalg.norm(REST, axis=1) > 3.5, 0] = 1.0
    residual = np.linalg.norm(rigid_residual(REST, moved)[0], axis=1)
    assert residual.max() < 1.0
    assert residual.mean() > 0.3


def test_entropy_is_nothing_for_even_motion_and_all_for_spread_motion() -> None:
    even = np.ones((1, 16, 2))
    spread = np.zeros((1, 16, 2))
    spread[0, :, 0] = (np.arange(16) + 0.5) / 15.5
    assert entropy(even).tolist() == [0.0]
    assert entropy(spread) == pytest.approx(4.0)
    assert entropy(np.zeros((1, 16, 2))).tolist() == [0.0]


def test_markers_on_a_line_have_no_strain() -> None:
    line = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    with pytest.raises(InputError, match="marker 0: is in no triangle of markers"):
        strains(line, np.zeros((1, 3, 2)))
    with pytest.raises(InputError, match="marker 0"):
        strains(REST[:2], np.zeros((1, 2, 2)))
