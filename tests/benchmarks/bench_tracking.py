"""The tables of docs/tracking.md: error, identities, what is kept, drift and speed, and what filming costs.

Run it as it is: ``python tests/benchmarks/bench_tracking.py``, or with some of its cases only (``--cases``). Every
table is printed in Markdown; the clips have known truth. The plain tracker beside ours takes the nearest blob in each
frame. ``--seed`` gives the bad clips other noise, texture and reflections. ``--clips FOLDER`` follows recordings
instead, whose truth nobody knows, and judges by what is known: where the sensor looks as in the first frame, markers
are back at their places. NAME.mask.png beside a recording is its mask.
"""

import argparse
import functools
import itertools
import sys
import tempfile
import time
import warnings
from pathlib import Path

import cv2
import numpy as np
import setups

import fingerslip as fs
from fingerslip.vision.cameras.pixel import DARK_ON_BRIGHT, HARSH_LIGHT, LAMPS, MOULDED, frames_of
from fingerslip.vision.tracking.follow import follow, rest_state
from fingerslip.vision.tracking.tracker import reference_of
from fingerslip.vision.video import frame_state, open_frames, rest_exposure, write_video
from problems import clips
from problems.nearest import track_flow, track_nearest, track_trackpy

REST, RATE = 20, 60.0
line, table = functools.partial(setups.line, digits=3), setups.table
WORST = clips.with_look(clips.BAD, marker=150.0, background=50.0)


def ours(frames, truth, **options):
    """Return positions of all markers of the truth; NaN where lost."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fs.TrackingWarning)
        try:
            tracks = fs.track_markers(frames, rest_frames=REST, frame_rate=RATE, **options)
        except fs.InputError:
            return np.full(truth.shape, np.nan)
    return clips.in_true_order(tracks["position"].values, truth)


def head(cells):
    sys.stdout.write("\n")
    table(*cells.split(" | "))


def percent(share):
    return f"{100.0 * share:.2f}"


def scores(positions, look, seed=0, layout="rings"):
    """Return how our tracker and the plain one follow a clip."""
    frames, truth = list(clips.filmed(positions, look, seed=seed)), clips.truth_of(positions, look)
    own = clips.scored(ours(frames, truth, n_markers=truth.shape[1], layout=layout), truth)
    return own, clips.scored(track_nearest(frames, truth[0], look.radius, look.marker > look.background), truth)


def compared(name, *paths, look=clips.DEFAULT, seed=0, layout="rings"):
    """Print a row: what all clips of some paths come to, ours and by the plain tracker."""
    own, plain = zip(*(scores(path, look, seed + k, layout) for k, path in enumerate(paths)), strict=True)
    cells = []
    for found in (own, plain):
        rms, kept = np.sqrt(np.mean([score.rms**2 for score in found])), [score.kept for score in found]
        cells += [float(rms), max(score.worst for score in found), percent(np.mean(kept)), percent(min(kept))]
        cells += [sum(score.stray for score in found), sum(score.swapped for score in found)]
        cells.append(sum(score.swapped_last for score in found))
    line(name, len(paths), sum(path.shape[0] * path.shape[1] for path in paths), *cells)


COLUMNS = "rms [px] | largest [px] | kept [%] | worst [%] | stray | swaps | swapped at the end"
COMPARED = f"clip | clips | marker-frames | {COLUMNS} | plain: {COLUMNS}"


def error():
    """Error against blur, noise, size and contrast."""
    head(COMPARED)
    path = clips.slide(clips.field(), 1.0, count=90, rest=REST)
    changes = {"blur": (0.4, 0.8, 1.5, 2.5, 4.0), "noise": (0.0, 5.0, 10.0, 20.0), "radius": (2.0, 3.0, 8.0, 12.0)}
    changes |= {"marker": (155.0, 145.0, 125.0, 85.0), "exposure": (0.5, 1.0)}
    for name, values in changes.items():
        for value in values:
            compared(f"{name} {value:g}", path, look=clips.with_look(clips.DEFAULT, **{name: value}))


def directions():
    """Identities over eight directions with 40 px of travel, slow and fast."""
    head(COMPARED)
    for count in (60, 10, 4, 2):
        paths = [clips.slide(clips.field(), k * np.pi / 4, count=REST + count, rest=REST) for k in range(8)]
        compared(f"{count} frames", *paths)


def bad(seed=10):
    """Share kept and identities on bad clips."""
    head(COMPARED)
    rings, lattice, quarters = clips.field(), clips.field(layout="hex", rings=6), [k * np.pi / 2 for k in range(4)]
    slides = [clips.slide(rings, angle) for angle in quarters]
    compared("dark markers, 81 in rings", *slides, look=clips.BAD, seed=seed)
    compared("bright markers, 81 in rings", *slides, look=WORST, seed=seed)
    slides, small = (
        [clips.slide(lattice, angle, travel=30.0) for angle in quarters],
        clips.with_look(clips.BAD, radius=4.0),
    )
    compared("dark markers, 127 hexagonal", *slides, look=small, seed=seed, layout="hex")
    compared("dark markers, pressed", *[clips.press(rings, count=120)] * 4, look=clips.BAD, seed=seed)


def vanish():
    """Markers that vanish for a while during a slide."""
    head("frames hidden | markers hidden | found in them | frames until found again | kept of the rest [%] | swaps")
    for frames, markers in ((1, 8), (10, 8), (30, 8), (10, 40)):
        positions = clips.slide(clips.field(), 0.5)
        which = np.random.default_rng(frames).choice(81, markers, replace=False)
        hidden = np.zeros(positions.shape[:2], dtype=bool)
        hidden[50 : 50 + frames, which] = True
        truth = clips.truth_of(positions, clips.DEFAULT)
        found = ours(list(clips.filmed(positions, clips.DEFAULT, hidden=hidden)), truth, n_markers=81)
        score = clips.scored(found, truth, hidden)
        back = np.isfinite(found[50 + frames :, which, 0])
        line(frames, markers, int(np.isfinite(found[..., 0])[hidden].sum()), int(np.argmax(back, axis=0).max()),
             percent(score.kept), score.swapped)  # fmt: skip


def trackers():
    """Trackers side by side: kept [%] / swaps, all of them started where the markers are, ours without any hint."""
    table("clip", "ours", "nearest blob", "optical flow", "trackpy")
    rings, lattice = clips.field(), clips.field(layout="hex", rings=6)
    lost = np.zeros((80, 81), dtype=bool)
    lost[40:60, np.random.default_rng(1).choice(81, 16, replace=False)] = True
    cases = {
        "pressed": (clips.press(rings), clips.DEFAULT, None),
        "halves part by half a distance": (clips.part(rings, 0.5), clips.DEFAULT, None),
        "halves part by a whole distance": (clips.part(rings, 1.0), clips.DEFAULT, None),
        "the same, hexagonal lattice": (clips.part(lattice, 1.0), clips.with_look(clips.DEFAULT, radius=4.0), None),
        "reflections, flicker, JPEG": (clips.slide(rings, 0.0, count=80), WORST, None),
        "a fifth is hidden for 20 frames": (clips.slide(rings, 0.5, count=80), clips.DEFAULT, lost),
        "markers touch and part": (clips.pinch(rings, 0.7), clips.with_look(clips.DEFAULT, radius=11.0), None),
    }
    for name, (path, look, hidden) in cases.items():
        frames, truth = list(clips.filmed(path, look, hidden=hidden)), clips.truth_of(path, look)
        start, bright = truth[0], look.marker > look.background
        blobs, trackpy = (track(frames, start, look.radius, bright) for track in (track_nearest, track_trackpy))
        tracks = ours(frames, truth), blobs, track_flow(frames, start), trackpy
        scores = [clips.scored(position, truth, hidden) for position in tracks]
        line(name, *(f"{percent(score.kept)} / {score.swapped}" for score in scores))


def lamps():
    """Frames that look like the recordings, with truth: moulded pins, lamps, a white mount. Kept [%] / swaps."""
    table("clip", "pins found", "ours, no hint", "ours, stray", "ours, number and mask", "nearest blob", "optical flow")
    scale, looks = 64e-3 / 640.0, []
    lens = fs.pinhole_for_view(640, 480, 64e-3, 50e-3)
    filming = fs.Camera(lens, fs.Pose((0.0, 0.0, 50e-3), (0.0, 0.0, 0.0)), frame_rate=RATE)
    pins = fs.hexagonal_layout(22.0, 6).position
    paths = {"slides by 40 px": clips.slide(pins, 0.5), "pressed": clips.press(pins),
             "halves part by half a distance": clips.part(pins, 0.5)}  # fmt: skip
    for seed, (name, path) in enumerate(paths.items()):
        places = np.concatenate([scale * path, np.zeros_like(path[..., :1])], axis=2)
        tracks = fs.make_tracks(places, np.arange(len(path)) / RATE, units="m")
        pixels = fs.PixelCamera(filming, MOULDED, LAMPS, fs.SensorNoise(1.5, 0.01), 85, seed)
        frames, truth = list(frames_of(pixels, tracks)), fs.true_tracks(filming, tracks)["position"].values
        mask = np.hypot(*(np.indices((480, 640)) - [[[239.5]], [[319.5]]])) < 160.0
        own = ours(frames, truth)
        told = ours(frames, truth, n_markers=truth.shape[1], mask=mask)
        others = track_nearest(frames, truth[0], 6.0, True), track_flow(frames, truth[0])
        first, hinted, *rest = (clips.scored(position, truth) for position in (own, told, *others))
        cells = [f"{percent(score.kept)} / {score.swapped}" for score in (hinted, *rest)]
        pins_found, unaided = int(np.isfinite(own[0, :, 0]).sum()), f"{percent(first.kept)} / {first.swapped}"
        line(name, pins_found, unaided, first.stray, *cells)
        looks.append((name, frames, mask))
    sys.stdout.write("\n")
    statistics(looks)


def statistics(clips_with_masks):
    """Print what frames look like where the pins are, of clips with their masks."""
    table("frames", "grey levels 1, 10, 50, 90, 99 %", "saturated inside, outside [%]", "outside", "noise", "pins",
          "radius [px]", "contrast")  # fmt: skip
    for name, frames, mask in clips_with_masks:
        mean, noise = np.mean(frames[:5], axis=0), np.abs(np.diff(np.array(frames[:2], dtype=float), axis=0)[0])
        markers = reference_of(mean, mask, None, "auto", None, name).markers
        columns, lines = np.round(markers.position).astype(int).T
        around = cv2.dilate(mean.astype(np.float32), None), cv2.erode(mean.astype(np.float32), np.ones((25, 25)))
        contrast = np.median(around[0][lines, columns] - around[1][lines, columns])
        levels = ", ".join(f"{level:.0f}" for level in np.percentile(mean[mask], (1, 10, 50, 90, 99)))
        saturated = ", ".join(percent((frames[0][part] >= 250).mean()) for part in (mask, ~mask))
        line(name, levels, saturated, float(np.median(mean[~mask])), float(1.05 * np.median(noise[mask])),
             len(columns), float(np.median(markers.radius)), float(contrast))  # fmt: skip


def recordings(folder):
    """Print for each recording which shares [%] of the markers are home at rest, wrong, and home at the last rest."""
    shares = "seen", "home", "wrong", "last home"
    looks = []
    table("recording", "hint", "tracker", "markers", "rest frames", *shares, "CPU ms a frame")
    for video in sorted(path for path in folder.iterdir() if path.suffix in {".avi", ".mp4", ".mkv"}):
        masks = [mask for mask in [video.with_suffix(".mask.png")] if mask.exists()]
        frames = list(open_frames(video).read())
        for mask in [*masks, None]:
            image = np.mean(frames[:10], axis=0)
            allowed = None if mask is None else cv2.imread(str(mask), cv2.IMREAD_GRAYSCALE) > 0
            markers = reference_of(image, allowed, None, "auto", None, video.name).markers
            rest = _at_rest(frames, _region(image.shape, markers.position) if allowed is None else allowed)
            hint = "mask" if mask else "none"
            for name, call in _trackers(markers, frames, allowed).items():
                begin = time.process_time()
                judged = _judged(call(), rest)
                cost = 1e3 * (time.process_time() - begin) / len(frames)
                line(video.stem, hint, name, len(markers.position), int(rest.sum()), *judged, cost)
        looks += [(video.stem, frames[:5], cv2.imread(str(mask), cv2.IMREAD_GRAYSCALE) > 0) for mask in masks]
    sys.stdout.write("\n")
    statistics(looks)


def _trackers(markers, frames, mask):
    start, radius, bright = markers.position, float(np.median(markers.radius)), markers.polarity > 0.0
    return {
        "ours": functools.partial(_follow, markers, frames, mask),
        "nearest blob": functools.partial(track_nearest, frames, start, radius, bright),
        "optical flow": functools.partial(track_flow, frames, start),
        "trackpy": functools.partial(track_trackpy, frames, start, radius, bright),
    }


def _region(shape, points):
    hull = cv2.convexHull(points.astype(np.float32)).astype(np.int32)
    return cv2.fillConvexPoly(np.zeros(shape, dtype=np.uint8), hull, 1) > 0


def _at_rest(frames, region):
    """Tell which frames look as the first does in a region, whatever the light: what varies over a few pixels."""
    bands = []
    for frame in frames:
        fine, coarse = (cv2.GaussianBlur(frame.astype(np.float32), (0, 0), width)[region] for width in (2.0, 8.0))
        bands.append((fine - coarse) - (fine - coarse).mean())
    alike = [float(band @ bands[0] / np.sqrt((band @ band) * (bands[0] @ bands[0]))) for band in bands]
    return (np.array(alike) > 0.85) & (np.arange(len(frames)) >= 5)


def _judged(position, rest):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of markers that are never seen
        off = np.linalg.norm(position - np.nanmean(position[:5], axis=0), axis=2)
    home, wrong = off[rest] < 4.0, off[rest] >= 6.0
    shares = np.isfinite(off).mean(), home.mean(), wrong.mean(), home[-1].mean()
    return tuple(round(100.0 * float(share), 1) for share in shares)


def drift():
    """Drift over an hour of rest at 30 frames a second, of which every 600th frame is made and tracked."""
    head("light | frames tracked | largest drift of a marker [px] | rms drift [px] | noise of a frame [px]")
    unsteady = clips.with_look(clips.DEFAULT, drift=0.3, flicker=0.02)
    for name, look in (("steady", clips.DEFAULT), ("loses 30 %, flickers 2 %", unsteady)):
        positions = clips.still(clips.field(), 180)
        found = ours(list(clips.filmed(positions, look)), positions, n_markers=81)
        moved = np.nanmean(found[-36:], axis=0) - np.nanmean(found[:36], axis=0)
        drifts = float(np.linalg.norm(moved, axis=1).max()), float(np.sqrt((moved**2).mean()))
        line(name, len(found), *drifts, float(np.nanstd(found - positions)))


def speed():
    """CPU time of a frame of 1920 x 1080 with 81 markers."""
    look = clips.Look(shape=(1080, 1920), radius=10.0)
    positions = clips.slide(clips.field(look), 1.0, count=200, rest=REST)
    with tempfile.TemporaryDirectory() as folder:
        video = Path(folder) / "clip.avi"
        write_video(video, clips.filmed(positions, look), RATE)
        frames = list(open_frames(video).read())
        reference = reference_of(np.mean(frames[:10], axis=0), None, 81, "rings", None, "clip")
        follow(reference.markers, rest_state(reference.markers), frames[0], None)
        head("part | CPU ms a frame | frames a second")
        parts = {"follow 81 markers": _timed(lambda: _follow(reference.markers, frames), len(frames))}
        rest = rest_exposure(frames[0])
        judge = lambda: [frame_state(b, a, rest) for a, b in itertools.pairwise(frames)]  # noqa: E731
        parts["judge the exposure"] = _timed(judge, len(frames))
        parts["decode MJPEG"] = _timed(lambda: sum(1 for _ in open_frames(video).read()), len(frames))
        parts["all three"] = sum(parts.values())
        for name, seconds in parts.items():
            line(name, 1e3 * seconds, 1.0 / seconds)
        whole = _timed(lambda: fs.track_markers(video, n_markers=81, rest_frames=REST), len(frames))
        line(f"track_markers, {len(frames)} frames with the first search", 1e3 * whole, 1.0 / whole)
        start = positions[0]
        plain = _timed(lambda: track_nearest(frames[:20], start, look.radius), 20)
        line("plain tracker, without decoding", 1e3 * plain, 1.0 / plain)


def camera():
    """CPU time of frames that a pixel camera takes of 81 sliding markers, clean and with all faults, and of points."""
    cv2.setNumThreads(1)
    layout, times = fs.ring_layout(2.6e-3), np.arange(0.0, 5.0, 0.01)
    position = np.zeros((times.size, layout.count, 3))
    position[:, :, :2] = layout.position
    position[:, :, 0] += 0.3e-3 * times[:, None]
    tracks = fs.make_tracks(position, times, units="m")
    harsh = {"lighting": HARSH_LIGHT, "noise": fs.SensorNoise(2.0, 0.05), "jpeg_quality": 80}
    head("frames | size [px] | CPU ms a frame | times real time")
    for width, height in ((640, 480), (1920, 1080)):
        lens = fs.pinhole_for_view(width, height, 0.04, 0.05)
        filming = fs.Camera(lens, fs.Pose((0.0, 0.0, 0.05), (0.0, 0.0, 0.0)))
        count = fs.true_tracks(filming, tracks).sizes["time"]
        looks = {
            "clean": fs.PixelCamera(filming),
            "dark on bright": fs.PixelCamera(filming, DARK_ON_BRIGHT),
            "all faults": fs.PixelCamera(filming, **harsh),
        }
        calls = {name: functools.partial(lambda look: sum(1 for _ in frames_of(look, tracks)), look)
                 for name, look in looks.items()}  # fmt: skip
        calls["points"] = functools.partial(fs.point_tracks, fs.PointCamera(filming), tracks)
        for name, call in calls.items():
            seconds = _timed(call, count)
            line(name, f"{width} x {height}", 1e3 * seconds, 1.0 / filming.frame_rate / seconds)


def _follow(markers, frames, mask=None):
    state, course = rest_state(markers), []
    for frame in frames:
        state, position, _ = follow(markers, state, frame, mask)
        course.append(position)
    return np.array(course)


def _timed(call, count):
    best = np.inf
    for _ in range(3):
        start = time.process_time()
        call()
        best = min(best, time.process_time() - start)
    return best / count


CASES = {case.__name__: case for case in (error, directions, bad, vanish, trackers, lamps, drift, speed, camera)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", nargs="*", choices=CASES, default=list(CASES))
    parser.add_argument("--seed", type=int, default=10, help="first seed of the bad clips")
    parser.add_argument("--clips", type=Path, metavar="FOLDER", help="recordings to follow instead")
    cv2.setNumThreads(1)
    given = parser.parse_args()
    if given.clips is not None:
        recordings(given.clips)
        return
    for name in given.cases:
        sys.stdout.write(f"\n{CASES[name].__doc__}\n")
        bad(given.seed) if name == "bad" else CASES[name]()


if __name__ == "__main__":
    main()
