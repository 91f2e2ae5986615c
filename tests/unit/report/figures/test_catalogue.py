"""Figures by name: which runs they can show, that all of them can be drawn; films, and a history to browse."""

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.report.content import (
    HAS,
    OF_RUNS,
    OF_STUDIES,
    RUN_FIGURES,
    STUDY_FIGURES,
    STYLES,
    RunSubject,
    StudySubject,
)
from fingerslip.report.figures.motion import Film, film_frames
from fingerslip.report.figures.style import LOOKS
from fingerslip.report.page import pictures
from fingerslip.report.page.pictures import _DRAW_RUNS, _DRAW_STUDIES, draw_of_run, draw_of_study
from fingerslip.report.scene.options import SceneOptions
from unit.report.figures import made
from unit.report.figures.made import HISTORY, marked, panels, titles
from unit.report.figures.test_figures import FIGURES, STRAIN_MODELS
from unit.report.scenes import block_history
from unit.synthetic import Process, make

EVENTS = fs.Events(slip=fs.SlipEvents(incipient=0.06, overall=0.09))


def test_kinds_are_those_that_can_be_drawn_and_each_is_in_the_table_of_figures():
    assert list(RUN_FIGURES) == list(_DRAW_RUNS)
    assert list(STUDY_FIGURES) == list(_DRAW_STUDIES)
    assert {need for kind in (*RUN_FIGURES.values(), *STUDY_FIGURES.values()) for need in kind.needs} == {*HAS}
    assert not OF_RUNS.keys() & OF_STUDIES.keys()
    assert all((*OF_RUNS.values(), *OF_STUDIES.values()))
    assert {*RUN_FIGURES, *STUDY_FIGURES} <= FIGURES.keys()
    assert list(LOOKS) == list(STYLES)


def test_figures_that_a_run_or_a_study_cannot_have_are_refused_with_those_that_fit():
    flat, solid = (RunSubject(history, fs.Events()) for history in (make(Process()), block_history("T4")))
    for kind, figure in RUN_FIGURES.items():
        for subject, dimensions, words in ((flat, 3, "three, this one has two"), (solid, 2, "two, this one has three")):
            if figure.dimensions == dimensions:
                with pytest.raises(fs.InputError, match=f"'{kind}' shows runs of {words} dimensions, needs one"):
                    draw_of_run(kind, subject)
    with pytest.raises(fs.ResultError, match="no reference nodes"):
        draw_of_run("reference-nodes", solid)
    with pytest.raises(fs.InputError, match="'latency' has nothing on its axis, needs a study with a sweep"):
        draw_of_study("latency", StudySubject((), {}, {}))


@pytest.mark.slow
@pytest.mark.parametrize("element", ["Q4", pytest.param("T4", marks=pytest.mark.slow)])
def test_frames_have_the_asked_size_and_number_and_change_but_for_what_stands_still(element):
    film = Film(size=(640, 360), frame_rate=8.0, seconds=1.0)
    frames = np.array(list(film_frames(block_history(element), EVENTS, film=film)))
    assert (frames.shape, frames.dtype) == ((8, 360, 640, 3), np.uint8)
    assert (frames[0] != frames[-1]).any()
    # An event is named from its time on: between the lines at events and at the time of a frame nothing moves.
    plot = frames[..., int(0.62 * 640) : int(0.97 * 640), :]
    assert (plot == plot[0]).all(axis=(0, 1, 3)).any()
    bare = next(film_frames(block_history(element), EVENTS, SceneOptions(written=False), film))
    np.testing.assert_array_equal(frames[0], bare, err_msg="time and colours are written once")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"size": (481, 270)}, "got 481x270, needs an even width and height"),
        ({"frame_rate": 0.0}, "--rate: got 0"),
        ({"seconds": float("inf")}, "--seconds: got inf"),
    ],
)
def test_a_film_that_cannot_be_written_is_refused(values, words):
    with pytest.raises(fs.InputError, match=words):
        Film(**values)


@pytest.mark.slow
def test_the_time_of_a_history_to_browse_decides_what_is_drawn(monkeypatch):
    history = make(Process())
    plot = fs.plot(history)
    above, below = plot.figure.axes
    times = history["time"].values
    assert plot.at(float(times[-1])) is plot
    assert below.lines[-1].get_xdata()[0] == times[-1]
    drawn = np.asarray(above.collections[0].get_offsets())
    assert np.allclose(drawn[:, 1], 1e-3 * history["normal_traction"].values[-1])
    assert above.texts[0].get_text() == f"{times[-1]:.3f} s"
    assert repr(plot) == f"<HistoryPlot: {times.size} records, 0 to {times[-1]:g} s>"
    monkeypatch.setattr("fingerslip.report.figures.motion._FRAMES", 3)
    page = plot._repr_html_()
    assert 'type="range"' in page, "notebooks get a slider that needs no kernel"
    assert page.count("data:image/png;base64") == 3
    with pytest.raises(fs.InputError, match="history: has no contact nodes"):
        fs.plot(history.isel(contact_node=slice(0)))


def test_a_history_is_drawn_by_name_with_its_events_or_those_that_are_given():
    for events, expected in ((None, made.EVENTS.slip.incipient), (fs.Events(slip=fs.SlipEvents(incipient=1.3)), 1.3)):
        figure = fs.draw(HISTORY, "forces", events=events, title="mine")
        assert expected in marked(panels(figure)[0])
        assert figure.get_suptitle() == "Forces and slipped area: mine"
    frames = fs.draw(block_history(), "slip-frames", times=(0.05, 0.1), style="paper")
    assert [title[:7] for title in titles(frames)] == ["0.050 s", "0.100 s"]
    assert frames.get_figwidth() == 7.2
    with pytest.raises(fs.InputError, match="kind: got 'x', needs one of composed, deformed"):
        fs.draw(HISTORY, "x")
    with pytest.raises(fs.InputError, match="style: got 'x', needs one of page, paper, column, slides"):
        fs.draw(HISTORY, "forces", style="x")
    late = fs.Spikes(("u1",), ("SA-I",), (np.array([100.0]),), 99.0, 101.0)
    with pytest.raises(fs.InputError, match=r"recorded: has spikes from 100 to 100 s, needs some from 0 to .* shift"):
        fs.draw(HISTORY, "spikes", recorded=late)
    with pytest.raises(fs.InputError, match="recorded: got a list, needs fs"):
        fs.draw(HISTORY, "spikes", recorded=[0.1, 0.2])
    with pytest.raises(fs.InputError, match="recorded: is given for 'forces', needs the kind composed or spikes"):
        fs.draw(HISTORY, "forces", recorded=late)
    with pytest.raises(fs.InputError, match=r"afferents: 'FA1' is not known, needs some of FA-I.*; write FA-I"):
        fs.draw(HISTORY, "spikes", afferents={"FA1": fs.human_afferents()["FA-I"]})
    with pytest.raises(fs.ResultError, match=r"history: has no markers, needs some; write record: {groups: "):
        fs.draw(HISTORY, "markers")
    for kind in ("spikes", "acceleration", "strain-energy-density"):
        with pytest.raises(fs.ResultError, match="history: has no receptors, needs some; write record"):
            fs.draw(HISTORY.drop_dims("site"), kind)


def test_a_recording_of_a_type_without_a_colour_is_drawn_and_said(monkeypatch):
    monkeypatch.setattr(pictures, "draw_of_run", lambda _, run: run.recorded)
    recorded = fs.Spikes(["u"], ["FA1"], [[0.05]], 0.0, 0.1)
    with pytest.warns(UserWarning, match="recorded: FA1 is none of FA-I, SA-I, FA-II, SA-II"):
        assert fs.draw(HISTORY, "spikes", recorded=recorded) is recorded


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["spikes", "composed"])
def test_a_recording_is_below_what_models_of_its_type_fire_with_a_named_row_for_each_unit(kind):
    # Lists, arrays and columns of MATLAB are taken, too.
    kinds, times = ("SA-I", "FA-II", "SA-I"), ([0.05], [0.01], np.array([[0.02], [0.09]]))
    recorded = fs.Spikes(["u1", "v", "u2"], np.array(kinds), times, 0.0, 0.1)
    figure = fs.draw(block_history("Q4"), kind, afferents=STRAIN_MODELS, recorded=recorded)
    rasters = {axes.get_ylabel(): axes for axes in panels(figure) if "A-I" in axes.get_ylabel()}
    assert list(rasters) == ["1 FA-II\nby x", "FA-II\nrecorded\n1 row", "SA-I\nrecorded\n2 rows"]
    raster = rasters["SA-I\nrecorded\n2 rows"]
    assert [list(row.get_positions()) for row in raster.collections] == [[0.02, 0.09], [0.05]], "first on top"
    assert [label.get_text() for label in raster.get_yticklabels()] == ["u2", "u1"]
    assert raster.get_xlim() == panels(figure)[0].get_xlim()
    assert any("lines of slip are of the simulation" in axes.get_xlabel().replace("\n", " ") for axes in figure.axes)
