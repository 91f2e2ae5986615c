"""Motions that march together are those that march alone; what is still the same is computed once."""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics import march
from fingerslip.dynamics.simulation import simulate_together
from fingerslip.dynamics.step import condensation
from fingerslip.linear import threads
from problems.matrices import EXACT, needs_mkl
from problems.pushed import push_and_slide

PRESS = fs.Press(2e-4, 4e-3)


def models():
    """Return models that slide to either side, with other friction, deeper, for longer, and under gravity."""
    first = push_and_slide(programme=(PRESS, fs.Slide(4e-4, 4e-3)))
    back = dataclasses.replace(first, programme=(PRESS, fs.Slide(4e-4, 4e-3, (-1.0, 0.0))))
    rough = dataclasses.replace(first, contacts=(dataclasses.replace(first.contacts[0], friction=fs.Coulomb(0.9)),))
    deep = dataclasses.replace(first, programme=(fs.Press(4e-4, 4e-3), fs.Slide(6e-4, 4e-3)))
    heavy = dataclasses.replace(first, gravity=(0.0, -5.0))
    return [first, back, rough, deep, heavy]


def assert_same(one, other, share=1e-8):
    assert one.sizes == other.sizes
    for name in one.data_vars:
        if name not in {"contact_iterations", "contact_residual", "energy_imbalance"}:
            wanted = one[name].values
            if not wanted.size:
                continue
            np.testing.assert_allclose(other[name], wanted, atol=share * np.abs(wanted).max() + 1e-300, err_msg=name)
            assert wanted.any() or not other[name].any()


@pytest.mark.parametrize("largest", [0, 10**9], ids=["schur", "columns"])
def test_histories_are_those_of_single_simulations(largest, monkeypatch):
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", largest)
    together = simulate_together(models(), solver=EXACT)
    for model, history in zip(models(), together, strict=True):
        assert history.attrs["n_simulated_together"] == 5
        assert_same(fs.simulate(model, solver=EXACT), history)


@needs_mkl
def test_factors_of_single_precision_of_other_candidates_round_otherwise(monkeypatch):
    """Alone a motion has its own candidates, and so factors of its own."""
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 0)
    for model, history in zip(models(), simulate_together(models()), strict=True):
        assert history.attrs["condensation"].endswith("single precision")
        assert_same(fs.simulate(model), history, 1e-4)


@pytest.mark.slow
def test_several_threads_find_the_same_contact_forces(monkeypatch):
    """The contact problems of different motions are solved side by side, by factors that they share at first."""
    monkeypatch.setattr("fingerslip.contact.solve.forces._FEW", 0)
    one_thread = simulate_together(models())
    many_threads(monkeypatch)
    for alone, beside in zip(one_thread, simulate_together(models(), threads=4), strict=True):
        assert_same(alone, beside)


def many_threads(monkeypatch):
    """Have more threads than there may be cores."""
    monkeypatch.setattr(threads, "usable_cores", lambda: 8)


@pytest.mark.parametrize(("wanted", "pools"), [(1, []), (4, [4]), (8, [5])])
def test_one_pool_of_threads_serves_the_whole_march_and_ends_with_it(wanted, pools, monkeypatch):
    made = []

    class Counted(ThreadPoolExecutor):
        def __init__(self, size):
            super().__init__(size)
            made.append((size, self))

    many_threads(monkeypatch)
    monkeypatch.setattr(threads, "ThreadPoolExecutor", Counted)
    simulate_together(models(), threads=wanted)
    assert [size for size, _ in made] == pools
    for _, pool in made:
        with pytest.raises(RuntimeError, match="after shutdown"):
            pool.submit(print)


def test_motions_are_computed_once_until_they_part(monkeypatch):
    """Three directions press alike for 0.05 s, ten steps; then there are three motions, two of them twins."""
    numbers, advance = [], march.advance
    monkeypatch.setattr(
        march, "advance", lambda *given, **more: numbers.append(len(given[0])) or advance(*given, **more)
    )
    first, back = models()[:2]
    histories = simulate_together([first, back, first])
    assert numbers == [1] * 10 + [2] * (len(numbers) - 10)
    np.testing.assert_array_equal(histories[0].displacement, histories[2].displacement)
    assert (histories[0].counterface_force.values[-1, 0, 0]) * histories[1].counterface_force.values[-1, 0, 0] < 0.0


def test_progress_counts_the_longest_motion():
    seen = []
    simulate_together(models()[::3], progress=seen.append)
    assert seen[-1] == 1.0
    assert seen == sorted(seen)


def test_models_that_cannot_share_are_refused_before_anything_is_computed(monkeypatch):
    monkeypatch.setattr(march, "advance", lambda *_, **__: pytest.fail("it must not start"))
    first = models()[0]
    with pytest.raises(fs.InputError, match=r"models\.1\.depth"):
        simulate_together([first, dataclasses.replace(first, depth=2.0)])
