"""From videos to tracks: truth, bad clips, bad input, measures of quality, lenses, and frames as they come."""

from __future__ import annotations

import dataclasses
import functools
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
import trackpy
import xarray as xr
from numpy.typing import NDArray

from fingerslip.detect.synthetic import SyntheticSlide, film_trials, synthetic_trial
from fingerslip.detect.trials import Trial
from fingerslip.errors import InputError
from fingerslip.vision.cameras.camera import Camera, Pose, true_tracks
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole, pinhole_for_view, write_calibration
from fingerslip.vision.cameras.pixel import LAMPS, MOULDED, PixelCamera, SensorNoise, frames_of
from fingerslip.vision.tracking.track import (
    Lost,
    MarkerTracker,
    TrackingWarning,
    jumps,
    lost_intervals,
    noise_at_rest,
    seen_count,
    seen_share,
    still_markers,
    track_markers,
    undistort_pixels,
)
from fingerslip.vision.tracks import check_tracks, make_tracks, read_tracks, tracks_table, write_tracks
from fingerslip.vision.video import opencv, write_video
from problems import clips

REST, RATE = 10, 60.0
SMALL = clips.with_look(clips.DEFAULT, shape=(360, 480))
FIELD = clips.field(SMALL)


@dataclass(frozen=True)
class Clip:
    frames: list[NDArray[np.uint8]]
    truth: NDArray[np.float64]
    tracks: xr.Dataset


def follow(frames, **options) -> xr.Dataset:
    return track_markers(frames, **{"rest_frames": REST, "n_markers": 81, "frame_rate": RATE, **options})


def tracked(positions: NDArray[np.float64], look: clips.Look = SMALL, **options) -> Clip:
    seed, hidden = options.pop("seed", 0), options.pop("hidden", None)
    frames = list(clips.filmed(positions, look, seed=seed, hidden=hidden))
    tracks = follow(frames, **{"n_markers": positions.shape[1], **options})
    return Clip(frames, clips.truth_of(positions, look), tracks)


def score_of(made: Clip) -> clips.Score:
    return clips.scored(made.tracks["position"].values, made.truth)


@pytest.fixture(scope="module")
def clip() -> Clip:
    """Return a slide of 81 markers by 40 px, in 40 frames."""
    return tracked(clips.slide(clips.field(), 0.7, count=40, rest=REST), clips.DEFAULT)


def test_tracks_are_the_truth_in_the_order_of_the_layout_and_can_be_written(clip: Clip, tmp_path: Path) -> None:
    position = check_tracks(clip.tracks)["position"].values
    assert np.sqrt(((position - clip.truth) ** 2).mean()) < 0.02
    assert np.abs(position - clip.truth).max() < 0.1
    assert np.bincount(clip.tracks["ring"].values).tolist() == [1, 8, 16, 24, 32]
    assert clip.tracks["time"].values == pytest.approx(np.arange(40) / RATE)
    assert clip.tracks["reference"].values == pytest.approx(clips.field(), abs=0.02)
    assert (clip.tracks.attrs["partial"], clip.tracks.attrs["warnings"]) == (0, "")
    write_tracks(clip.tracks, tmp_path / "tracks.nc")
    again = read_tracks(tmp_path / "tracks.nc")
    assert np.array_equal(again["position"], clip.tracks["position"])
    assert np.array_equal(again["reference"], clip.tracks["reference"])


# Along none of the axes of the layout; the others are in the slow tier.
@pytest.mark.parametrize("eighth", [pytest.param(one, marks=[pytest.mark.slow] * (one != 3)) for one in range(8)])
def test_no_identity_is_swapped_in_eight_directions(eighth: int) -> None:
    positions = clips.slide(FIELD, eighth * np.pi / 4, travel=30.0, count=REST + 10, rest=REST)
    score = score_of(tracked(positions))
    assert (score.swapped, score.stray, score.kept) == (0, 0, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("bright", [False, True])
def test_bad_clip_is_kept(bright: bool) -> None:
    look = clips.with_look(clips.BAD, marker=150.0, background=50.0) if bright else clips.BAD
    score = score_of(tracked(clips.slide(clips.field(), 2.0, count=44, rest=REST), look, seed=3))
    assert score.kept > 0.99
    assert score.swapped == 0
    assert score.rms < 0.1


@pytest.mark.slow
def test_markers_that_slip_past_their_neighbours_are_kept() -> None:
    """The rim slips by half the distance between markers, in jerks, and the middle sticks."""
    distance, number = np.linalg.norm(FIELD - FIELD.mean(axis=0), axis=1), np.arange(40)[:, None]
    spacing = np.sort(np.linalg.norm(FIELD - FIELD[0], axis=1))[1]
    phase, rim = np.clip((number - REST) / (30 - REST), 0.0, 1.0), distance > 2.5 * spacing
    slip = spacing * rim * (0.45 * phase + 0.12 * np.sin(2.0 * number) * (phase > 0.0))
    score = score_of(tracked(FIELD + np.stack([slip, 0.0 * slip], axis=2)))
    assert (score.swapped, score.kept) == (0, 1.0)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*leap past their neighbours or touch")
@pytest.mark.parametrize("layout", ["rings", "hex"])
def test_halves_that_part_by_a_whole_distance_between_markers_are_kept(layout: str) -> None:
    points = clips.field(layout=layout, rings=4 if layout == "rings" else 5)
    made = tracked(clips.part(points, 1.0, count=40, rest=REST), clips.DEFAULT, n_markers=None)
    score = clips.scored(clips.in_true_order(made.tracks["position"].values, made.truth), made.truth)
    assert made.tracks.attrs["layout"] == layout
    assert (score.swapped, score.kept) == (0, 1.0)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*not seen in more than a tenth:fingerslip.vision.tracking.track.TrackingWarning")
@pytest.mark.filterwarnings("ignore:.*leap past their neighbours or touch")
@pytest.mark.parametrize(("radius", "share"), [(9.0, 0.99), (11.0, 0.97)])
def test_markers_that_touch_or_overlap_are_themselves_when_they_part(radius: float, share: float) -> None:
    path, look = clips.pinch(clips.field(), 0.7, count=40, rest=REST), clips.with_look(clips.DEFAULT, radius=radius)
    assert 20.0 < np.linalg.norm(path[:, 1:5] - path[:, :1], axis=2).min() < 20.2
    made = tracked(path, look)
    score = score_of(made)
    assert score.swapped == 0
    assert score.kept >= share
    assert clips.scored(made.tracks["position"].values[-8:], made.truth[-8:]).kept == 1.0


def right(trial: Trial, folder: Path, kind: str, rest: int) -> tuple[float, str]:
    """Return which share of the marker-frames of a film is within 5 px of the truth, and what is said of the tracks."""
    film = folder / (f"{trial.name}.mkv" if kind == "internal" else f"{trial.name}-outside.mkv")
    truth = clips.seen_by(trial, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TrackingWarning)
        tracks = track_markers(film, n_markers=truth.shape[1], rest_frames=rest)
    apart = np.linalg.norm(clips.in_true_order(tracks["position"].values, truth) - truth, axis=2)
    return float((apart < 5.0).mean()), tracks.attrs["warnings"]


def test_pin_that_slips_alone_is_itself_beside_and_under_others(tmp_path: Path) -> None:
    """Outer pins of a slide of the tutorial leap by as much as they are apart; six come to lie on another one."""
    slide = SyntheticSlide(4e-3, 4.0 * np.pi / 3.0, 1.008, seed=10, travel=6e-3)
    whole = synthetic_trial("slide-0010", slide, clips.SMALL_SENSOR)
    # The outer pins come first; of the others one is filmed.
    chosen = whole.tracks.isel(marker=slice(20), time=[*range(8), *range(123, 153)])
    trial = dataclasses.replace(whole, tracks=chosen.assign_coords(time=np.arange(38) / 30.0))
    film_trials([trial], tmp_path / "films")
    share, said = right(trial, tmp_path / "films", "external", 8)
    assert share > 0.98
    assert "18 of 19 markers leap past their neighbours or touch, from 0.33 s" in said


@pytest.mark.slow
def test_slides_of_the_tutorial_are_kept(tmp_path: Path) -> None:
    trials = clips.tutorial_slides()
    film_trials(trials.values(), tmp_path / "films")
    for trial in trials.values():
        for kind in ("internal", "external"):
            share, _ = right(trial, tmp_path / "films", kind, 20)
            assert share > 0.995, (trial.name, kind)


@pytest.mark.slow
def test_marker_that_vanishes_for_ten_frames_is_found_again() -> None:
    positions = clips.slide(FIELD, 0.5, travel=30.0, count=32, rest=REST)
    hidden = np.zeros((32, 81), dtype=bool)
    hidden[16:26, [0, 30, 72]] = True
    with pytest.warns(TrackingWarning, match="3 of 81 markers were not seen in more than a tenth"):
        made = tracked(positions, hidden=hidden)
    found = np.isfinite(made.tracks["position"].values[..., 0])
    assert np.array_equal(found, ~hidden)
    assert (made.tracks["quality"].values[hidden] == 0).all()


@pytest.mark.slow
def test_trackpy_finds_the_same(clip: Clip) -> None:
    for t in (0, 30):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = trackpy.locate(255 - clip.frames[t], diameter=15, minmass=2000, topn=81)
        other = found[["x", "y"]].to_numpy()
        position = clip.tracks["position"].values[t]
        apart = np.linalg.norm(position[:, None] - other[None], axis=2)
        assert len(set(apart.argmin(axis=1))) == 81
        assert np.sqrt((apart.min(axis=1) ** 2).mean()) < 0.03


@pytest.mark.slow
def test_drift_at_rest_while_the_light_fades() -> None:
    made = tracked(clips.still(FIELD, 30), clips.with_look(SMALL, drift=0.5))
    position = made.tracks["position"].values
    assert np.abs(position[-10:].mean(axis=0) - position[:10].mean(axis=0)).max() < 0.05


def test_calibration_straightens_positions_and_keeps_those_of_the_image(clip: Clip, tmp_path: Path) -> None:
    lens = Pinhole(640, 480, 400.0, 400.0, 320.0, 240.0, (-0.1, 0.0, 0.0, 0.0))
    write_calibration(lens, tmp_path / "camera.yml")
    tracks, by_file = (follow(clip.frames[:12], calibration=one) for one in (lens, tmp_path / "camera.yml"))
    xr.testing.assert_identical(tracks, by_file)
    assert np.array_equal(tracks["image_position"].values, clip.tracks["position"].values[:12])
    assert np.abs(tracks["position"].values - tracks["image_position"].values).max() > 3.0


def test_mask_as_array_and_image(clip: Clip, tmp_path: Path) -> None:
    mask = np.zeros((480, 640), dtype=bool)
    mask[:, :330] = True
    opencv().imwrite(str(tmp_path / "mask.png"), mask.astype(np.uint8) * 255)
    for given in (mask, tmp_path / "mask.png"):
        tracks = track_markers(clip.frames[:3], rest_frames=2, frame_rate=RATE, mask=given, layout="free")
        assert (tracks["position"].values[0, :, 0] < 330).all()
    with pytest.raises(
        InputError, match=r"mask: has the shape \(480, 100\), needs \(480, 640\), .*; draw it on a frame"
    ):
        track_markers(clip.frames, frame_rate=RATE, mask=mask[:, :100])
    opencv().imwrite(str(tmp_path / "black.png"), 0 * mask.astype(np.uint8))
    with pytest.raises(InputError, match=r"mask: .*black.png: leaves out all pixels, needs some that count, white in"):
        track_markers(clip.frames, frame_rate=RATE, mask=tmp_path / "black.png")
    with pytest.raises(InputError, match=r"mask: none.png: cannot be read as an image"):
        track_markers(clip.frames, frame_rate=RATE, mask="none.png")


@functools.cache
def still() -> list[NDArray[np.uint8]]:
    """Return frames of markers that rest; tests leave them as they are."""
    return list(clips.filmed(clips.still(FIELD, 14), SMALL))


# Frame 12 is odd, the light is bad, or the rest is none.
WRONG = (
    (lambda f: [*f[:12], f[12] // 12, *f[13:]], "1 of 14 frames are dark, the first is frame 12"),
    (lambda f: [*f[:12], np.full_like(f[12], 255), *f[13:]], "1 of 14 frames are overexposed"),
    (lambda f: [*f[:12], f[11], *f[13:]], "1 of 14 frames are duplicated"),
    (lambda f: [frame // 20 for frame in f], r"is dark, mean grey level \d of 255 at rest"),
    (lambda f: [cv2.add(frame, frame) for frame in f], r"is overexposed, \d\d % of the pixels"),
    (lambda f: f[:6], "ends within the 10 rest frames, after 6; all are the reference"),
    (lambda f: [np.roll(frame, shift // 3, axis=1) for shift, frame in enumerate(f)], r"the sensor moved by .* px in"),
)


@pytest.mark.parametrize(("change", "words"), WRONG)
def test_what_is_wrong_with_frames_is_said_and_marked(change: Callable[[list], list], words: str) -> None:
    frames = change(still())
    with pytest.warns(TrackingWarning, match=words):
        tracks = follow(frames)
    assert (tracks.attrs["partial"], tracks.attrs["rest_frames"]) == (0, min(REST, len(frames)))
    is_odd = words.startswith("1 of")
    assert np.flatnonzero(tracks["frame_state"].values).tolist() == [12] * is_odd
    if is_odd:
        assert np.isnan(tracks["position"].values[12]).all() == ("duplicated" not in words)
        assert tracks["quality"].values[12].max() <= 0.5
        assert np.isfinite(tracks["position"].values[13:]).all()


def test_a_texture_that_is_followed_may_be_none_of_markers() -> None:
    rough = cv2.GaussianBlur(np.random.default_rng(5).standard_normal((240, 320)), (0, 0), 6.0)
    frame = np.clip(128.0 + 40.0 * rough / rough.std(), 0, 255).astype(np.uint8)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TrackingWarning)  # its frames are alike
        tracks = follow([frame] * REST, n_markers=None)
    assert "in no pattern and fit round markers by 0.8" in tracks.attrs["warnings"]
    assert follow(still(), layout="free").attrs["warnings"] == ""


def test_rest_that_ends_early_names_how_many_frames_rest() -> None:
    frames = [np.roll(frame, max(number - 7, 0), axis=1) for number, frame in enumerate(still())]
    with pytest.warns(TrackingWarning, match=r"moved by 2\.0 px in the 10 rest frames; .*; it rests in 6: --rest 6$"):
        follow(frames)
    found = follow(frames, rest_frames=None)
    assert (found.attrs["rest_frames"], found.attrs["warnings"]) == (6, ""), "without their number those that rest"
    np.testing.assert_allclose(found["reference"], found["position"][:6].mean("time"), atol=1e-4)
    assert set(tracks_table(found)["still"]) == {0}


def test_markers_that_do_not_move_with_their_neighbours_are_named() -> None:
    rows = np.stack(np.meshgrid(np.arange(6.0), np.arange(6.0)), axis=-1).reshape(-1, 2) * 20.0
    position = rows + np.linspace(0.0, 8.0, 30)[:, None, None] * (1.0, 0.0)
    # Of three reflections side by side one is lost for a while, and a marker at the rim moves by half.
    position[:, [0, 1, 6]] = rows[[0, 1, 6]]
    position[10:20, 1] = np.nan
    position[:, 35] = rows[35] + 0.5 * (position[:, 35] - rows[35])
    assert np.flatnonzero(still_markers(position)).tolist() == [0, 1, 6]
    assert not still_markers(rows + 0.1 * (position - rows)).any(), "neighbours move by less than 3 px"
    for share, is_still in ((0.35, True), (0.45, False)):
        position[:, 35] = rows[35] + share * (rows[35] + np.linspace(0.0, 8.0, 30)[:, None] * (1.0, 0.0) - rows[35])
        assert still_markers(position)[35] == is_still
    # Inside a block of reflections all neighbours are reflections, too.
    block = [row * 6 + column for row in range(2, 5) for column in range(2, 5)]
    position[:, block] = rows[block]
    assert set(block) <= set(np.flatnonzero(still_markers(position)))
    assert not still_markers(position[:, :4]).any()


@pytest.mark.slow
def test_truncated_video_gives_partial_tracks(tmp_path: Path, clip: Clip) -> None:
    write_video(tmp_path / "whole.avi", clip.frames, RATE)
    content = (tmp_path / "whole.avi").read_bytes()
    (tmp_path / "cut.avi").write_bytes(content[: len(content) // 2])
    with pytest.warns(TrackingWarning, match=r"ends after .* frames"):
        tracks = follow(tmp_path / "cut.avi", frame_rate=None)
    assert tracks.attrs["partial"] == 1
    assert 10 < tracks.sizes["time"] < 40


def test_lost_intervals_and_swaps_are_told(clip: Clip) -> None:
    assert (seen_count(clip.tracks) == 81).all()
    assert (seen_share(clip.tracks), lost_intervals(clip.tracks)) == (1.0, [])
    assert 0.002 < np.median(noise_at_rest(clip.tracks)) < 0.03
    tracks = clip.tracks.copy(deep=True)
    for marker, first, last in ((3, 5, 9), (3, 20, 20), (7, 30, 39)):
        tracks["position"][first : last + 1, marker] = np.nan
    assert lost_intervals(tracks) == [Lost(3, 5, 9, True), Lost(3, 20, 20, True), Lost(7, 30, 39, False)]
    assert lost_intervals(tracks)[0].frames == 5
    assert np.nanmax(jumps(clip.tracks)) < 3.0
    tracks = clip.tracks.copy(deep=True)
    swapped = tracks["position"].values[20:, [11, 12]]
    tracks["position"][20:, [12, 11]] = swapped
    found = jumps(tracks)
    assert found.shape == (39, 81)
    assert np.argwhere(found > 20.0).tolist() == [[19, 11], [19, 12]]
    assert found[19, 11] == pytest.approx(np.linalg.norm(swapped[0, 0] - swapped[0, 1]), rel=0.2)


@pytest.mark.slow
def test_frames_that_come_one_by_one_give_what_the_tracks_have_and_few_frames_no_reference(clip: Clip) -> None:
    tracker = MarkerTracker(n_markers=81, rest_frames=REST)
    taken = [tracker.take(frame, number / RATE) for number, frame in enumerate(clip.frames)]
    assert [len(rows) for rows in taken] == [0] * 9 + [10] + [1] * 30
    rows = [row for rows in taken for row in rows]
    for name in ("position", "quality", "time"):
        np.testing.assert_array_equal([getattr(row, name) for row in rows], clip.tracks[name].values)
    assert min(row.seconds for row in rows) > 0
    with pytest.raises(InputError, match="a frame is 10 x 20 px, needs 640 x 480 px"):
        tracker.take(np.zeros((20, 10), dtype=np.uint8), 9.0)
    (again,) = tracker.take(np.repeat(clip.frames[-1][:, :, None], 3, axis=2), 9.0)  # in colour, as cameras give it
    assert np.abs(again.position - rows[-1].position).max() < 0.5
    tracker = MarkerTracker(rest_frames=REST)
    tracker.take(clip.frames[0], 0.0)
    with pytest.raises(InputError, match=r"frames: got 1 frames, needs 10 to find its markers in"):
        _ = tracker.reference
    assert len(tracker.begin()) == 1
    assert len(tracker.reference.markers.position) == 81


BENT = Pinhole(640, 480, 500.0, 510.0, 320.0, 240.0, (-0.2, 0.05, 0.001, -0.002))


@pytest.mark.parametrize("lens", [BENT, Fisheye(640, 480, 300.0, 300.0, 320.0, 240.0, (0.02, 0.0, 0.0, 0.0))])
def test_what_lenses_bend_is_bent_back(lens: Pinhole | Fisheye) -> None:
    points = np.random.default_rng(0).uniform([-0.3, -0.2, 1.0], [0.3, 0.2, 1.0], (20, 3))
    straight = points[:, :2] * (lens.focal_x, lens.focal_y) + (lens.centre_x, lens.centre_y)
    assert undistort_pixels(lens, lens.project(points)) == pytest.approx(straight, abs=1e-6)
    found = undistort_pixels(lens, np.array([[np.nan, np.nan], [320.0, 240.0]]))
    assert np.isnan(found[0]).all()
    assert found[1] == pytest.approx([320.0, 240.0])


def test_what_is_found_is_judged_by_what_is_visible() -> None:
    few = r"40 markers are followed, where \d\d blobs like them are visible"
    with pytest.warns(TrackingWarning, match="asked for 40 markers"), pytest.warns(TrackingWarning, match=few):
        tracks = follow(still()[:8], n_markers=40, rest_frames=4)
    # Those farther from the ones that are followed than a marker is from the next are not counted.
    assert (tracks["visible"].values > 70).all()
    assert seen_share(tracks) == pytest.approx(40 / tracks["visible"].values.mean())
    assert seen_share(tracks.drop_vars("visible")) == 1.0


def test_bad_arguments_and_videos_have_clear_errors(clip: Clip, tmp_path: Path) -> None:
    (tmp_path / "text.mp4").write_text("no video")
    write_video(tmp_path / "empty.avi", [np.full((120, 160), 90, dtype=np.uint8)] * 3, RATE)
    two = list(clips.filmed(clips.still(FIELD[[3, 40]], 4), SMALL))
    for video, options, words in (
        (clip.frames, {"n_markers": 0}, "n_markers: got 0, needs a number >= 1"),
        (clip.frames, {"rest_frames": 0}, "rest_frames: got 0"),
        (clip.frames, {"layout": "square"}, "layout: got 'square'"),
        (clip.frames, {"frame_rate": None}, "states no frame rate"),
        (tmp_path / "text.mp4", {}, "cannot be read as a video"),
        (tmp_path / "gone.mp4", {}, "is not there"),
        (tmp_path / "empty.avi", {}, "found no markers in the first frames"),
        (two, {"n_markers": None}, "found 2 markers in the first frames.*needs at least 10 blobs"),
    ):
        with pytest.raises(InputError, match=words):
            follow(video, **options)
    for frames in (clip.frames[:2], clip.frames[0].tolist(), None):
        with pytest.raises(InputError, match=r"needs uint8 or uint16, .*; give grey levels"):
            MarkerTracker().take(frames, 0.0)


def test_pins_are_followed_without_hints_on_frames_that_look_like_recordings():
    path = clips.slide(clips.hexagonal_layout(22.0, 6).position, 0.5, count=30, rest=REST)
    places = np.concatenate([1e-4 * path, np.zeros_like(path[..., :1])], axis=2)
    camera = Camera(pinhole_for_view(640, 480, 64e-3, 50e-3), Pose((0.0, 0.0, 50e-3), (0.0, 0.0, 0.0)), frame_rate=RATE)
    moving = make_tracks(places, np.arange(len(path)) / RATE, units="m")
    frames = list(frames_of(PixelCamera(camera, MOULDED, LAMPS, SensorNoise(1.5, 0.01), 85), moving))
    truth = true_tracks(camera, moving)["position"].values
    tracks = follow(frames, n_markers=None)
    score = clips.scored(clips.in_true_order(tracks["position"].values, truth), truth)
    assert tracks.sizes["marker"] == 127
    assert score.kept > 0.97
    assert score.swapped == 0
