"""The detector that ships: slides with a truth, presses, rests in between, and its page."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from fingerslip.detect import page
from fingerslip.detect.evaluation.inquiries import disturb
from fingerslip.detect.labels import Onsets
from fingerslip.detect.model_file import write_detector
from fingerslip.detect.page import SlipClip, answer_of, slide_table, slip_report, write_slip_page
from fingerslip.detect.residual import (
    ResidualSettings,
    Slide,
    detect_residual,
    findings_table,
    frames_at_rest,
    slides_of,
)
from fingerslip.detect.session import run_detector, watch_camera
from fingerslip.detect.synthetic import SyntheticSensor, SyntheticSlide, synthetic_slides, synthetic_trial
from fingerslip.detect.timeline import read_timeline, timeline_figure
from fingerslip.detect.training import train
from fingerslip.detect.trials import Trial
from fingerslip.errors import InputError
from fingerslip.marker_layouts import hexagonal_layout
from fingerslip.report.page.page import render_page
from fingerslip.study.inspection.views import FigureChoice, kinds_text, write_figure
from fingerslip.tables.table import Column, Missing, Table
from fingerslip.vision.cameras.camera import Camera, Pose
from fingerslip.vision.cameras.intrinsics import pinhole_for_view
from fingerslip.vision.cameras.pixel import LAMPS, MOULDED, PixelCamera, frames_of
from fingerslip.vision.tracking.track import track_markers
from fingerslip.vision.tracks import make_tracks, write_tracks, write_tracks_csv
from fingerslip.vision.video import Frames
from places import ROOT
from problems import clips
from unit.detect.conftest import MOTION, SAMPLING

SENSOR = SyntheticSensor(metres_per_pixel=120e-6)
SETTINGS = ResidualSettings(rest_frames=20)


def trial(direction: float = 0.0, friction: float = 0.8, seed: int = 0, indentation: float = 3e-3) -> Trial:
    slide = SyntheticSlide(indentation, direction, friction, seed=seed, travel=6e-3)
    return synthetic_trial("slide", slide, SENSOR)


def moved(displacement: np.ndarray, noise: float = 0.03) -> xr.Dataset:
    """Return tracks of a grid of 49 markers, 20 px apart, that go through displacements (n_times, 49, 2) [px]."""
    grid = np.stack(np.meshgrid(np.arange(7.0), np.arange(7.0)), axis=-1).reshape(-1, 2)
    noisy = displacement + np.random.default_rng(0).normal(0.0, noise, displacement.shape)
    return make_tracks(100 + 20 * grid + noisy, np.arange(len(displacement)) / 30.0, units="px")


def under_lamps(angle: float, seed: int, *, slips: bool) -> xr.Dataset:
    """Return what a tracker makes of 91 pins under six lamps: the rim slips from 2 s on, the middle from 4 s on."""
    layout = hexagonal_layout(2.2e-3, 5)
    places, times = np.asarray(layout.position)[:, :2], np.arange(0.0, 4.5, 1 / 30)
    carried = 2e-3 * np.clip(times - 1.0, 0.0, None if slips else 1.3)
    far = np.linalg.norm(places, axis=1) / np.linalg.norm(places, axis=1).max()
    sticks = far <= 1.001 * np.clip(1.0 - (times[:, None] - 2.0) / 2.0, 0.0, 1.0)
    stuck = sticks | (times[:, None] < 2.0) | (not slips)
    steps = np.diff(carried, prepend=0.0)[:, None] * np.where(stuck, 1.0, -0.3)
    moved = (
        np.cumsum(steps * (times[:, None] < 4.0), axis=0)
        * 0.93 ** np.clip(30 * (times - 4.0), 0, None if slips else 0)[:, None]
    )
    position = places + moved[..., None] * [np.cos(angle), np.sin(angle)]
    tracks = make_tracks(position, times, units="m", ring=layout.ring, angle=layout.angle)
    lens = pinhole_for_view(640, 480, view_width=46e-3, distance=50e-3)
    camera = Camera(lens, Pose((0.0, 0.0, 50e-3), (0.0, 0.0, 0.0)), frame_rate=30.0, exposure=8e-3)
    return track_markers(list(frames_of(PixelCamera(camera, MOULDED, LAMPS, seed=seed), tracks)), frame_rate=30.0)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*markers")
@pytest.mark.parametrize(("angle", "seed"), [(0.0, 1), (1.0, 2)])
def test_reflections_of_lamps_are_no_slip_and_do_not_hide_it(angle: float, seed: int) -> None:
    assert detect_residual(under_lamps(angle, seed, slips=False))[-1].onsets == Onsets(None, None)
    onsets = detect_residual(under_lamps(angle, seed, slips=True))[-1].onsets
    assert (onsets.incipient, onsets.gross) == (pytest.approx(2.1, abs=0.15), pytest.approx(4.05, abs=0.1))


@pytest.mark.parametrize(("at_rest", "later", "slips"), [(1.0, 1.0, True), (0.9, 0.9, False), (0.9, 1.0, False)])
def test_markers_that_look_less_like_one_than_most_do_not_count(at_rest: float, later: float, slips: bool) -> None:
    """A fifth of the markers lags by a tenth from 10 px on."""
    carried = path((40, 0.0), (60, 30.0))[:, None]
    displacement = np.zeros((len(carried), 49, 2))
    displacement[..., 0] = carried - 0.1 * np.where(np.arange(49) % 5, 0.0, np.clip(carried - 10.0, 0.0, None))
    tracks = moved(displacement)
    tracks["quality"][:44, ::5], tracks["quality"][44:, ::5] = at_rest, later
    # In the last frames before the motion is seen, and later, no marker is.
    unseen = [42, 43, 50]
    tracks["quality"][unseen], tracks["position"][unseen] = 0.0, np.nan
    assert (detect_residual(tracks, SETTINGS)[-1].onsets.incipient is not None) == slips


def path(*levels: tuple[int, float]) -> np.ndarray:
    """Return values that go from level to level in so many frames each, (n_times,)."""
    frames, values = zip((0, 0.0), *levels, strict=True)
    return np.interp(np.arange(sum(frames)), np.cumsum(frames), values)


ALONG = np.tile([1.0, 0.0], (49, 1))
SPREAD = (np.stack(np.meshgrid(np.arange(7.0), np.arange(7.0)), axis=-1).reshape(-1, 2) - 3.0) / 3.0


@pytest.mark.parametrize(("direction", "friction", "seed"), [(0.0, 0.8, 0), (1.6, 0.7, 1), (4.0, 1.0, 2)])
def test_slip_begins_when_it_does(direction, friction, seed):
    case = trial(direction, friction, seed)
    for tracks in (case.tracks, disturb(case.tracks, "lost", 0.1), disturb(case.tracks, "noise", 0.1)):
        onsets = detect_residual(tracks, SETTINGS)[-1].onsets
        assert onsets.incipient == pytest.approx(case.labels["contact"].incipient, abs=0.11)
        assert onsets.gross == pytest.approx(case.labels["contact"].gross, abs=0.11)


def test_nothing_is_found_where_all_sticks():
    case = trial(friction=40.0)
    assert case.labels["contact"].first is None
    findings = detect_residual(case.tracks, SETTINGS)
    assert findings[-1].onsets.first is None
    assert max(entry.share for entry in findings) < 0.1
    assert findings[-1].displacement > 10.0


def yields(share: float, frames: int, noise: float, slipping: int = 0) -> xr.Dataset:
    """Return tracks of markers that go 24 px in so many frames, at the rim by a share less; some stop after 16 px."""
    travel, less = path((20, 0.0), (frames, 24.0), (20, 24.0)), 1.0 - share * (SPREAD**2).sum(axis=1) / 2.0
    along = np.tile(travel[:, None], len(SPREAD))
    along[:, :slipping] = np.minimum(along[:, :slipping], 16.0)
    return moved((along * less)[:, :, None] * ALONG, noise)


@pytest.mark.parametrize("noise", [0.005, 0.03, 0.1])
@pytest.mark.parametrize(("share", "frames"), [(0.1, 20), (0.25, 5)])
def test_how_a_sensor_that_sticks_yields_is_no_slip(share, frames, noise):
    (slide,) = slides_of(detect_residual(yields(share, frames, noise), SETTINGS))
    assert (slide.is_press, slide.onsets.first) == (False, None)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.25])
def test_slip_of_a_sensor_that_yields_is_told_when_it_begins(share):
    onsets = detect_residual(yields(share, 60, 0.03, slipping=7), SETTINGS)[-1].onsets
    assert onsets.incipient == pytest.approx(60 / 30, abs=0.11)


def test_markers_that_only_stop_are_no_denial_of_gross_slip_and_later_is_before_the_new_rest():
    clip = clip_of(
        yields(0.1, 60, 0.03, slipping=7).pad(time=(0, 150), mode="edge").assign_coords(time=np.arange(250) / 30)
    )
    (row,), (slide,) = slide_table(clip).rows, clip.slides
    assert row[4] is Missing.NOT_JUDGED
    assert findings_table(clip.findings, "", "").rows[1][1] is Missing.NOT_JUDGED
    assert "where they only stop, it is not seen" in slide_table(clip).note
    assert slide.onsets.incipient < clip.findings[clip.moments["later"]].time < slide.end


def stray(displacement: np.ndarray) -> None:
    """One marker in a corner is taken for something else."""
    displacement[60:, 0] += (25.0, -20.0)


def shake(displacement: np.ndarray) -> None:
    """The camera turns, comes nearer and tilts."""
    shaking, (x, y) = path((30, 0.0), (50, 1.0), (20, 1.0))[:, None], 60.0 * SPREAD.T
    turned = x + 0.1 * shaking * (x + y), y + 0.1 * shaking * (y - x)
    displacement += np.stack([place / (1.0 + 5e-4 * shaking * x) for place in turned], axis=2) - 60.0 * SPREAD


def reflect(displacement: np.ndarray) -> None:
    """An eighth of the markers are reflections, which stay; then the sensor turns aside."""
    aside = path((70, 0.0), (20, 8.0), (10, 8.0))[:, None, None] * np.array([0.0, 1.0])
    displacement += aside
    displacement[:, [3, 10, 21, 34, 44, 47]] = 0.0


@pytest.mark.parametrize("fault", [stray, shake, reflect])
def test_what_no_sensor_does_is_no_slip(fault):
    displacement = path((20, 0.0), (60, 12.0), (20, 12.0))[:, None, None] * ALONG
    fault(displacement)
    findings = detect_residual(moved(displacement), SETTINGS)
    (slide,) = slides_of(findings)
    assert (slide.is_press, slide.onsets.first) == (False, None)
    assert findings[-1].share < 0.1


RIM = np.argsort(np.linalg.norm(SPREAD, axis=1), kind="stable")[-20:]


@pytest.mark.parametrize("share", [0.0, 0.3])
@pytest.mark.parametrize("slips", [False, True])
def test_where_many_markers_stay_behind_slip_is_not_denied(share, slips):
    displacement = path((20, 0.0), (60, 12.0), (20, 12.0))[:, None, None] * ALONG
    displacement[:, RIM] *= share
    if slips:
        displacement[:, SPREAD[:, 0] > 0.5, 0] -= path((50, 0.0), (30, 5.0), (20, 5.0))[:, None]
    clip = clip_of(moved(displacement))
    (slide,) = clip.slides
    assert (slide.behind, slide.markers, slide.onsets.first is not None) == (20, 49, slips)
    *answer, behind = answer_of(clip)
    assert behind.startswith("In a slide 20 of 49 markers stay behind and are not counted")
    assert behind.endswith("nothing is said.") == (not slips)
    assert "".join(answer).startswith("Slip begins" if slips else "")
    assert ("".join(answer) == "") == (not slips)
    (row,), times = slide_table(clip).rows, findings_table(clip.findings, "", "").rows
    assert row[-1] == (99 if slips else Missing.NOT_JUDGED)
    assert (times[0][1] is Missing.NOT_JUDGED) == (not slips)
    displacement[:, RIM[4:]] = displacement[:, [24]]
    few = answer_of(clip_of(moved(displacement)))
    assert few[-1] == "In a slide 4 of 49 markers stay behind and are not counted."
    assert few[0].startswith("Slip begins" if slips else "No slip was found.")


def test_markers_beyond_the_contact_make_a_slide_a_press_and_are_left_out():
    away = np.linalg.norm(SPREAD, axis=1)
    touching = away < 0.7
    displacement = path((20, 0.0), (60, 12.0), (20, 12.0))[:, None, None] * ALONG
    displacement[:, ~touching] *= (0.7 / away[~touching, None]) ** 2.0
    # One side of the contact slips.
    displacement[:, touching & (SPREAD[:, 0] > 0.3), 0] -= path((50, 0.0), (30, 5.0), (20, 5.0))[:, None]
    tracks = moved(displacement)
    (whole,), (inside,) = clip_of(tracks).slides, clip_of(tracks.isel(marker=np.flatnonzero(touching))).slides
    assert (whole.is_press, inside.is_press) == (True, False)
    assert inside.onsets.incipient == pytest.approx(50 / 30, abs=0.2)


def test_a_slide_of_which_nothing_is_said_is_told_beside_one_that_slips_with_more_markers_behind():
    clip = clip_of(moved(path((20, 0.0), (20, 12.0))[:, None, None] * ALONG))
    slides = Slide(0.5, False, Onsets(1.0, None), behind=30, markers=49), Slide(2.0, False, behind=20, markers=49)
    answer = answer_of(replace(clip, findings=[replace(clip.findings[-1], slides=slides)]))
    assert answer[-1] == "In a slide 20 of 49 markers stay behind and are not counted: of slip in it nothing is said."


def test_markers_that_are_not_counted_and_presses_have_the_colour_and_the_values_of_nothing():
    displacement = path((20, 0.0), (60, 12.0), (20, 12.0))[:, None, None] * ALONG
    reflect(displacement)
    axes = page.field_figure(clip_of(moved(displacement))).axes[-1]
    colours = axes.collections[0].get_facecolor()
    assert np.ptp(colours[[3, 10, 21, 34, 44, 47]], axis=0).max() == 0.0
    assert (colours[3] != colours[0]).any()
    assert "white or grey ones are not counted" in str(slip_report(clip_of(moved(displacement))))
    clip = clip_of(moved(path((20, 0.0), (10, 6.0), (40, 6.0))[:, None, None] * SPREAD))
    (press,), values = clip.slides, page.timeline_of(clip).values
    is_press = values["time [s]"].between(press.start, press.end or np.inf)
    assert 0 < is_press.sum() < len(values)
    for name in ("sure of slip [%]", "left pattern [%]"):
        assert (values[name].isna() == is_press).all()
    assert np.isnan(clip.residual[40].residual).all()


def test_a_press_is_not_judged_and_a_slide_behind_it_is():
    press = path((20, 0.0), (10, 6.0), (40, 6.0), (90, 6.0), (20, 6.0))[:, None, None] * SPREAD
    slide = path((20, 0.0), (10, 0.0), (40, 0.0), (60, 12.0), (30, 18.0), (20, 18.0))[:, None, None] * ALONG
    # The outer columns stay behind in the second half of the slide.
    behind = path((130, 0.0), (30, -5.0), (20, -5.0))
    slide[:, np.abs(SPREAD[:, 0]) > 0.9, 0] += behind[:, None]
    findings = detect_residual(moved(press + slide), SETTINGS)
    first, second = slides_of(findings)
    assert (first.is_press, first.onsets.first, second.is_press) == (True, None, False)
    assert first.end < second.start
    assert second.onsets.incipient == pytest.approx(130 / 30, abs=0.3)
    assert second.onsets.gross is None
    assert findings[-1].onsets == second.onsets
    figure = timeline_figure(page.timeline_of(clip_of(moved(press + slide))))
    assert "new rest: displaced from there on" in [text.get_text() for text in figure.legends[0].texts]
    line = figure.axes[0].lines[0]
    assert np.isnan(np.asarray(line.get_ydata())).sum() == sum(slide.end is not None for slide in (first, second))


def test_markers_that_spring_back_are_gross_slip_and_those_that_are_pushed_back_are_none():
    for frames, is_gross in ((3, True), (60, False)):
        back = path((20, 0.0), (60, 12.0), (frames, 6.0), (10, 6.0))[:, None, None] * ALONG
        assert (detect_residual(moved(back), SETTINGS)[-1].onsets.gross is not None) == is_gross


def test_gross_slip_is_told_where_it_begins_though_the_rim_crept_back_before():
    *_, case = itertools.islice(synthetic_slides((3e-3,), 3, 2, sensor=SENSOR, travel=6e-3), 3)
    onsets, label = detect_residual(case.tracks, SETTINGS)[-1].onsets, case.labels["contact"]
    assert (onsets.incipient, onsets.gross) == pytest.approx((label.incipient, label.gross), abs=0.04)


@pytest.mark.parametrize(("rest", "expected"), [(8, 8), (40, 40), (150, 100), (1, 5)])
def test_rest_is_found(rest, expected):
    tracks = moved(path((rest, 0.0), (60, 60.0))[:, None, None] * ALONG)
    assert frames_at_rest(tracks) == pytest.approx(expected, abs=2)


@pytest.mark.parametrize("rest_frames", [5, 19, 25, 30, 60])
def test_rest_frames_that_reach_into_the_slide_change_nothing(rest_frames):
    case = trial()  # it rests for 20 frames
    findings = detect_residual(case.tracks, ResidualSettings(rest_frames=rest_frames))
    assert findings[0].time == case.tracks["time"].values[0]
    assert findings[-1].onsets.incipient == pytest.approx(case.labels["contact"].incipient, abs=0.11)
    assert findings[-1].onsets.gross == pytest.approx(case.labels["contact"].gross, abs=0.11)


def test_a_slide_begins_where_markers_first_leave_their_noise():
    tracks = moved(path((20, 0.0), (120, 12.0))[:, None, None] * ALONG)  # 0.1 px a frame
    (slide,) = slides_of(detect_residual(tracks, SETTINGS))
    assert slide.start == pytest.approx(20 / 30, abs=0.1)
    clip = clip_of(tracks)
    assert clip.moments["at rest"] <= 20


def test_a_clip_without_motion_or_with_frames_of_no_marker_rests():
    dark = STILL.copy(deep=True)
    dark["position"].values[[2, 9]] = np.nan
    for tracks in (STILL, dark):
        assert frames_at_rest(tracks) == 30
        assert detect_residual(tracks)[-1].slides == ()


STILL = moved(np.zeros((30, 49, 2)))


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda: frames_at_rest(STILL.isel(time=slice(4))), "tracks: have 4 frames, needs more than 5 at rest"),
        (lambda: detect_residual(STILL.isel(time=slice(9)), SETTINGS), "have 9 frames, needs the 20 at rest and more"),
        (lambda: detect_residual(STILL.isel(marker=slice(3)), SETTINGS), "frames: 3 markers are seen .* needs 5"),
        (lambda: ResidualSettings(rest_frames=0), "ResidualSettings.rest_frames: got 0, needs a number >= 1"),
        (lambda: ResidualSettings(share=0.0), "ResidualSettings.share: got 0.0, needs a number > 0"),
    ],
)
def test_what_cannot_be_judged_is_refused(act, message):
    with pytest.raises(InputError, match=message):
        act()


LATENCIES = ("median latency", "latency of 95 % of frames below", "largest latency")
LATENCY = Table("Latency", (Column(""), Column("value")), (("frames", "1"),))


def clip_of(tracks: xr.Dataset, frames: Frames | None = None) -> SlipClip:
    inside = tracks.isel(marker=np.flatnonzero(tracks["kind"].values == "internal"))
    return SlipClip("slide.avi", inside, detect_residual(inside, SETTINGS), LATENCY, frames)


def test_the_page_says_when_and_how_sure_and_shows_it(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "_PICTURES", 5)
    case = trial()
    frames = Frames("slide", 30.0, lambda: iter(np.full((200, 240, 320), 90, dtype=np.uint8)))
    clip = clip_of(case.tracks, frames)
    (row,) = slide_table(clip).rows
    assert row[2] == "slide"
    assert (row[3], row[4]) == pytest.approx((1.0, case.labels["contact"].gross), abs=0.15)
    assert row[5] == 99, "nothing is sure"
    answer, error = answer_of(clip)
    assert answer.startswith("Slip begins at 1.1")
    assert answer.endswith("slip: 99 %.")
    assert error.startswith("Error of the time when slip begins, in tests: 0.0 s (0.0 to 0.1) on analytic slides")
    assert "Of gross slip: 0.0 s (0.0 to 0.0), -0.1 s (-0.4 to 2.0); false in 5 of 5 clips in which" in error
    told, falsely, gross_error = tuple(zip(*page.tested_table().rows, strict=True))[-3:]
    assert (told, falsely) == ((64, 0, 0, 15, 5, 12, 20, 0), (0, 0, 0, 0, 5, 0, 0, 0))
    assert gross_error[0] == "0.00 (0.00 to 0.00)"
    tolerant = page.tested_table().columns[3].name
    assert tolerant == "false or over 0.1 s early", "elsewhere early is by however little"
    assert f"| {tolerant} |" in (ROOT / "docs" / "slip-in-your-video.md").read_text()
    trained = replace(clip, findings=[replace_kind(entry) for entry in clip.findings])
    assert answer_of(trained) == (answer, "Error of the time of slip: not known.")
    known = answer_of(replace(trained, time_error=(0.012, 0.001, 0.05, -0.003, 7)))[-1]
    assert known.endswith(
        ": 12 ms in size (1 to 50), -3 ms in the mean, in 7 trials that the detector did not learn from."
    )
    assert list(clip.moments) == ["at rest", "slip begins", "between", "gross slip begins"]
    text = write_slip_page(clip, tmp_path / "page").read_text()
    assert sorted(entry.name for entry in (tmp_path / "page").iterdir()) == [
        "clip.json",
        "slip.csv",
        "slip.html",
        "timeline.csv",
        "tracks.nc",
    ]
    kinds = [line.partition(":")[0] for line in kinds_text(tmp_path / "page").splitlines()]
    assert kinds == ["markers", "slip-timeline"]
    drawn, line = page.timeline_of(clip), read_timeline(tmp_path / "page")
    assert drawn.values["sure of slip [%]"].iloc[[0, -1]].tolist() == [0.0, 99.16]
    assert {axes.get_ylabel() for axes in page.field_figure(clip).axes} == {"y at rest [px]"}
    assert (line.name, line.slides) == (drawn.name, drawn.slides)
    # New rests are where ends of slides are times, to the last digit.
    assert line.values.equals(drawn.values)
    for form in ("png", "pdf", "svg"):
        choice = FigureChoice("slip-timeline", form=form)
        assert write_figure(tmp_path / "page", choice).name == f"slip-timeline.{form}"
    with pytest.raises(InputError, match="--kind: got 'events', needs one of slip-timeline"):
        write_figure(tmp_path / "page", FigureChoice("events"))
    tracks = tmp_path / "page" / "tracks.nc"
    assert write_figure(tracks, FigureChoice("markers", "column", "png")) == tracks.parent / "markers.png"
    (tmp_path / "detector.json").touch()
    with pytest.raises(InputError, match="is a detector, needs the folder that fingerslip detect evaluate"):
        kinds_text(tmp_path)
    with pytest.raises(InputError, match="has no figure confusion, needs the folder that fingerslip detect evaluate"):
        write_figure(tmp_path / "page", FigureChoice("confusion"))
    header = (tmp_path / "page" / "slip.csv").read_text().splitlines()[0]
    assert header == "begins [s],ends [s],what,slip [s],gross slip [s],sure [%]"
    assert "linearly across the markers looks like a camera that moves" in text
    assert "Orange is where slipping and sticking markers meet" in text
    for section in ("When", "Timeline", "Which markers", "The moments around", "How it was found", "Speed"):
        assert f">{section}</h2>" in text
    assert text.count("image/webp") == 2
    assert answer in text


@pytest.mark.slow
def test_a_page_is_not_written_over_that_of_another_recording_and_says_what_it_replaces(tmp_path):
    write_tracks(trial().tracks, tmp_path / "slide.nc")
    write_tracks_csv(trial().tracks, tmp_path / "slide.csv")
    folders = {"slide.nc": "slide_slip", "slide.csv": "slide-csv_slip"}
    for name, folder in folders.items():
        lines = run_detector(tmp_path / name, "residual", {})[1]
        assert lines[-1] == f"page: {tmp_path / folder / 'slip.html'}"
    lines = run_detector(tmp_path / "slide.nc", "residual", {})[1]
    assert lines[-1] == "replaced: what residual found in slide.nc"
    write_tracks(trial().tracks.assign_attrs(warnings="cut: ends after 9 of 20 frames"), tmp_path / "cut.nc")
    assert run_detector(tmp_path / "cut.nc", "residual", {})[1][0] == "warning: cut: ends after 9 of 20 frames"
    late = trial().tracks.assign_coords(time=1e3 * trial().tracks["time"].values)
    write_tracks_csv(late, tmp_path / "ms.csv")
    asked = f"warning: {tmp_path / 'ms.csv'}: a frame comes every 33.3 s; are its times in seconds?"
    assert run_detector(tmp_path / "ms.csv", "residual", {})[1][0] == asked


@pytest.mark.slow
def test_pages_without_a_video_without_a_slide_and_of_trained_detectors():
    still = clip_of(moved(np.zeros((40, 49, 2))))
    assert answer_of(still) == ("No slide was found.",)
    press = clip_of(moved(path((20, 0.0), (10, 6.0), (40, 6.0))[:, None, None] * SPREAD))
    (told,) = answer_of(press)
    assert told.startswith("Not judged: 1 motion is not rigid from the start")
    assert told.endswith("between press and slide; leave out markers beyond the contact with --mask.")
    slid = clip_of(trial().tracks)
    trained = replace(slid, findings=[replace_kind(entry) for entry in slid.findings])
    for clip, sections in ((still, 4), (press, 4), (slid, 5), (trained, 3)):
        report = slip_report(clip)
        assert len(report.sections) == sections
        assert "<html" in render_page(report)
    assert answer_of(trained)[0] == answer_of(slid)[0]
    assert [column.name for column in slide_table(trained).columns] == ["slip", "gross slip", "sure"]
    pictures = Frames("slide", 30.0, lambda: iter(np.full((200, 240, 320), 90, dtype=np.uint8)))
    (hero,) = slip_report(replace(trained, frames=pictures)).hero
    assert hero.caption.endswith("which of them slip, it does not say.")
    assert "the probability that the detector itself gives" in slide_table(trained).note
    assert slide_table(press).rows[0][2:] == ("not rigid", *[Missing.NOT_JUDGED] * 3)
    assert findings_table(press.findings, "", "").rows[0][1] is Missing.NOT_JUDGED


def replace_kind(finding):
    """Return a finding as a trained detector has it."""
    from fingerslip.detect.live import Finding

    return Finding(finding.time, finding.slip, finding.gross, finding.onsets, finding.seconds)


def test_a_camera_is_watched_and_events_are_told_as_they_come():
    look = clips.with_look(clips.DEFAULT, shape=(240, 320), radius=4.0)
    field = clips.field(look, rings=2)
    moved_by = path((22, 0.0), (34, 14.0), (2, 5.0), (8, 5.0))[:, None, None] * np.array([1.0, 0.0])
    frames = list(clips.filmed(field + moved_by, look, seed=0))
    told: list[str] = []
    rows = ((number / 30.0, frame) for number, frame in enumerate(frames) if number != 50)
    table = watch_camera(rows, "residual", {"n_markers": 25, "rest_frames": 20}, told.append)
    assert [line.partition(": ")[2].partition(" since")[0] for line in told] == ["slip", "gross slip"]
    assert float(told[1].partition(" s:")[0]) == pytest.approx(57 / 30, abs=0.1)
    assert [row[0].split(" [")[0] for row in table.rows[-4:]] == [*LATENCIES, "processed a second"]
    assert table.note.endswith("1 frames were dropped.")


@pytest.mark.slow
def test_a_trained_detector_that_needs_no_layout_watches_a_camera(trials, tmp_path):
    choices = {"motion": MOTION, "sampling": SAMPLING, "names": trials.names[:8]}
    write_detector(train(trials, trials.onsets(), "logistic:field", **choices), tmp_path / "detector")
    look = clips.with_look(clips.DEFAULT, shape=(240, 320), radius=4.0)
    still = clips.still(clips.field(look, rings=2), 24)
    rows = ((number / 30.0, frame) for number, frame in enumerate(clips.filmed(still, look, seed=0)))
    events = []
    table = watch_camera(rows, str(tmp_path / "detector"), {"n_markers": 25}, events.append)
    (warning,) = events
    assert re.fullmatch(r"warning: \d+ % of what the detector sees is beyond the range .*like this clip", warning)
    assert ("frames", "24") in table.rows
