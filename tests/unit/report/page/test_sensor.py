"""What a report shows of markers and cameras."""

from __future__ import annotations

from types import SimpleNamespace

from fingerslip.marker_tracks import filmed_tracks
from fingerslip.report.page.films import Film
from fingerslip.report.page.pictures import RunToDraw
from fingerslip.report.page.sensor import cameras_section, has_markers, marker_pictures, place_pictures
from fingerslip.slip import find_events
from fingerslip.vision.cameras.camera import external_camera, true_tracks
from unit.filmed import filmed_history
from unit.report.figures.made import EVENTS, HISTORY

NUMBERS = {"frames": 76, "markers": 5, "rms": 0.01, "largest": 0.04, "kept": 0.995, "swapped": 0}


def test_runs_with_markers_have_two_pictures_of_them():
    history = filmed_history()
    run = RunToDraw("run", "A run", history, find_events(history))
    assert has_markers(history)
    assert [picture.name for picture in (*place_pictures(run), *marker_pictures(run))] == ["markers-run", "run-markers"]


def test_runs_without_markers_have_none():
    run = RunToDraw("run", "A run", HISTORY, EVENTS)
    assert place_pictures(run) == marker_pictures(run) == []


def test_cameras_have_a_row_each_and_the_order_of_slip():
    history = filmed_history()
    camera = external_camera(30e-3, 14e-3, frame_rate=100.0, exposure=1e-3)
    truth = true_tracks(camera, filmed_tracks(history, "external", 0.5))
    film = Film("run", "external", truth, truth, NUMBERS, {})
    content = SimpleNamespace(films=(film,), histories={"run": history}, titles={"run": "A run"})
    section = cameras_section(content)
    assert section.tables[0].rows == (("run", "external", 76, 5, 0.01, 0.04, 99.5, 0),)
    assert [picture.name for picture in section.pictures] == ["run-external-camera-order"]


def test_without_films_the_section_is_empty():
    section = cameras_section(SimpleNamespace(films=(), histories={}, titles={}))
    assert not section.tables
    assert not section.pictures
    assert not section.text
