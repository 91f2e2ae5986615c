"""Spots are where they should be, and noise is white, normal and the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.vision.cameras.pixel import draw_spots, expose, normal_table


def drawn(middle, half=(0.0, 0.0), radius=5.0, softness=0.7, shape=(64, 80)) -> np.ndarray:
    picture = np.zeros(shape, dtype=np.float32)
    top = np.full(shape, 1.0, dtype=np.float32)
    draw_spots(picture, top, np.array([middle]), np.array([half]), np.array([radius]), softness)
    return picture


def middle_of(picture) -> tuple[float, float]:
    rows, columns = np.indices(picture.shape)
    return float((picture * columns).sum() / picture.sum()), float((picture * rows).sum() / picture.sum())


@pytest.mark.parametrize("radius", [1.0, 2.0, 5.0, 9.0])
@pytest.mark.parametrize("softness", [0.5, 0.7, 2.0])
def test_the_middle_of_a_spot_is_exact(radius, softness):
    """To 0.0025 px for small and sharp spots, and to 0.0002 px for those of 2 px and the softness of cameras."""
    random = np.random.default_rng(0)
    worst = 0.0
    for middle in random.uniform((30, 24), (50, 40), (30, 2)):
        found = middle_of(drawn(middle, radius=radius, softness=softness))
        worst = max(worst, *np.abs(np.subtract(found, middle)))
    assert worst < (2e-4 if radius >= 2 and softness > 0.5 else 2.5e-3)


@pytest.mark.parametrize("half", [(3.0, 0.0), (0.4, -2.2), (0.0, 0.05)])
def test_the_middle_of_a_smeared_spot_is_exact(half):
    picture = drawn((40.3, 31.8), half)
    np.testing.assert_allclose(middle_of(picture), (40.3, 31.8), atol=1e-3)
    assert picture.sum() == pytest.approx(drawn((40.3, 31.8)).sum(), rel=1e-3), "the light is spread, not lost"


def test_a_spot_covers_its_area():
    assert drawn((40.3, 31.8), radius=8.0).sum() == pytest.approx(np.pi * 64, rel=0.01)


def test_spots_at_the_edge_and_unknown_ones_do_no_harm():
    assert drawn((-2.0, -1.0)).sum() > 0
    assert drawn((-200.0, 1e9)).sum() == 0
    assert drawn((np.nan, 3.0)).sum() == drawn((3.0, 3.0), (np.inf, 0.0)).sum() == 0


def test_spots_over_each_other_stay_within_the_grey_levels():
    picture = np.zeros((64, 64), dtype=np.float32)
    top = np.full((64, 64), 200.0, dtype=np.float32)
    draw_spots(picture, top, np.full((3, 2), 32.0), np.zeros((3, 2)), np.full(3, 6.0), 0.7)
    assert picture.max() <= 200.0


GREY = np.full((240, 320), 100.0, dtype=np.float32)


def test_noise_has_its_deviation_and_is_white():
    frames = np.array([expose(GREY, 1.0, 9.0, 0.0, 5, number, normal_table()) for number in range(20)]).astype(float)
    errors = frames - frames.mean()
    count = frames.size
    assert frames.mean() == pytest.approx(100.0, abs=5 * 3 / np.sqrt(count))
    # Rounding to whole levels adds a twelfth.
    assert errors.var() == pytest.approx(9.0 + 1 / 12, rel=5 * np.sqrt(2 / count))
    for axis in range(3):
        for lag in (1, 2, 4):
            ahead, behind = (
                np.take(errors, range(lag, errors.shape[axis]), axis),
                np.take(errors, range(errors.shape[axis] - lag), axis),
            )
            assert abs((ahead * behind).mean() / errors.var()) < 5 / np.sqrt(count)


def test_shot_noise_grows_with_the_light():
    slope = np.tile(np.array([20.0, 180.0], dtype=np.float32), (200, 200))
    frame = expose(slope, 1.0, 1.0, 0.1, 0, 0, normal_table()).astype(float)
    assert frame[:, ::2].var() == pytest.approx(1 + 2 + 1 / 12, rel=0.05)
    assert frame[:, 1::2].var() == pytest.approx(1 + 18 + 1 / 12, rel=0.05)


def test_the_same_seed_and_number_give_the_same_noise():
    def one(seed: int, number: int) -> np.ndarray:
        return expose(GREY, 1.0, 4.0, 0.0, seed, number, normal_table())

    np.testing.assert_array_equal(one(2**63 - 1, 3), one(2**63 - 1, 3))
    assert (one(1, 3) != one(1, 4)).mean() > 0.5
    assert (one(1, 3) != one(2, 3)).mean() > 0.5
    assert (one(0, 1) != one(1, 0)).mean() > 0.5


def test_light_is_cut_and_rounded_to_grey_levels():
    light = np.array([[-5.0, 0.4, 0.6, 100.5, 254.7, 300.0]], dtype=np.float32)
    assert expose(light, 1.0, 0.0, 0.0, 0, 0, normal_table()).tolist() == [[0, 0, 1, 101, 255, 255]]
    assert expose(light, 2.0, 0.0, 0.0, 0, 0, normal_table()).tolist() == [[0, 1, 1, 201, 255, 255]]


def test_the_table_is_normal():
    table = normal_table().astype(float)
    assert (table.size, (np.diff(table) > 0).all()) == (65536, True)
    assert (table.mean(), table.var(), (table**4).mean()) == pytest.approx((0.0, 1.0, 3.0), abs=3e-3)
