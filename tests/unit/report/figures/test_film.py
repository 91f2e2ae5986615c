"""Frames of films."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.report.figures.film import Film, film_frames
from fingerslip.report.scene.options import SceneOptions
from fingerslip.slip import Events, SlipEvents
from unit.report.scenes import block_history

EVENTS = Events(slip=SlipEvents(incipient=0.06, overall=0.09))


@pytest.mark.parametrize("element", [pytest.param("Q4", marks=pytest.mark.slow), "T4"])
def test_frames_have_the_asked_size_and_number_and_change(element: str) -> None:
    film = Film(size=(480, 270), frame_rate=5.0, seconds=1.0)
    frames = list(film_frames(block_history(element), EVENTS, film=film))
    assert [frame.shape for frame in frames] == [(270, 480, 3)] * 5
    assert all(frame.dtype == np.uint8 for frame in frames)
    assert (frames[0] != frames[-1]).any()


@pytest.mark.parametrize("element", ["Q4", pytest.param("T4", marks=pytest.mark.slow)])
def test_nothing_moves_when_the_name_of_an_event_appears(element: str) -> None:
    film = Film(size=(640, 360), frame_rate=8.0, seconds=1.0)
    frames = np.array(list(film_frames(block_history(element), EVENTS, film=film)))
    # Between the lines that are drawn at events and at the time of a frame, grid lines stay where they are.
    plot = frames[..., int(0.62 * 640) : int(0.97 * 640), :]
    assert (plot == plot[0]).all(axis=(0, 1, 3)).any()


def test_time_and_colours_are_written_once() -> None:
    film = Film(size=(480, 270), frame_rate=1.0, seconds=1.0)
    by_default, bare = (
        next(film_frames(block_history("T4"), EVENTS, SceneOptions(written=written), film)) for written in (True, False)
    )
    np.testing.assert_array_equal(by_default, bare)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"size": (481, 270)}, "got 481x270, needs an even width and height"),
        ({"frame_rate": 0.0}, "--rate: got 0"),
        ({"seconds": float("inf")}, "--seconds: got inf"),
    ],
)
def test_a_film_that_cannot_be_written_is_refused(values: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Film(**values)  # type: ignore[arg-type]
