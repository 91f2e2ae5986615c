"""The tables of docs/tracking.md: error, identities, what is kept, drift and speed, on clips with known truth.

Run it as it is: ``python tests/benchmarks/bench_tracking.py [--cases error directions bad vanish drift speed]``. Every
table is printed in Markdown. The plain tracker beside ours takes the nearest blob in each frame. ``--seed`` gives the
bad clips other noise, texture and reflections.
"""

from __future__ import annotations

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
import rows

sys.path.insert(0, str(Path(__file__).parents[1]))

import fingerslip as fs
from fingerslip.vision.tracking.follow import follow, rest_state
from fingerslip.vision.tracking.reference import first_frames, reference_of
from fingerslip.vision.video import frame_state, open_frames, rest_exposure, write_video
from problems import clips
from problems.nearest import track_nearest

REST, RATE = 20, 60.0
line = functools.partial(rows.line, digits=3)
WORST = clips.with_look(clips.BAD, marker=150.0, background=50.0)


def ours(frames, truth, **options) -> np.ndarray:
    """Return positions of all markers of the truth; NaN where lost."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fs.TrackingWarning)
        try:
            tracks = fs.track_markers(frames, rest_frames=REST, frame_rate=RATE, **options)
        except fs.InputError:
            return np.full(truth.shape, np.nan)
    return clips.in_true_order(tracks["position"].values, truth)


def head(*cells) -> None:
    sys.stdout.write("\n")
    line(*cells)
    line(*["---"] * len(cells))


def percent(share: float) -> str:
    return f"{100.0 * share:.2f}"


def both(positions, look, seed=0, layout="rings") -> tuple[clips.Score, clips.Score]:
    frames, truth = list(clips.filmed(positions, look, seed=seed)), clips.truth_of(positions, look)
    own = clips.scored(ours(frames, truth, n_markers=truth.shape[1], layout=layout), truth)
    plain = track_nearest(frames, truth[0], look.radius, look.marker > look.background)
    return own, clips.scored(plain, truth)


def error() -> None:
    """Error against blur, noise, size and contrast."""
    head("changed", "value", "rms [px]", "largest [px]", "kept [%]", "swaps", "plain: rms [px]", "kept [%]", "swaps")
    changes = {
        "default": (None,),
        "blur": (0.4, 1.5, 2.5, 4.0),
        "noise": (0.0, 5.0, 10.0, 20.0),
        "radius": (2.0, 3.0, 8.0, 12.0),
        "contrast": (10.0, 20.0, 40.0, 80.0),
        "exposure": (0.5, 1.0),
    }
    for name, values in changes.items():
        for value in values:
            look = clips.DEFAULT
            if name == "contrast":
                look = clips.with_look(look, marker=look.background - value)
            elif value is not None:
                look = clips.with_look(look, **{name: value})
            own, plain = both(clips.slide(clips.field(), 1.0, count=90, rest=REST), look)
            line(name, "" if value is None else value, own.rms, own.worst, percent(own.kept), own.swapped,
                 plain.rms, percent(plain.kept), plain.swapped)  # fmt: skip


def directions() -> None:
    """Identities over eight directions with 40 px of travel, slow and fast."""
    head(
        "frames for 40 px",
        "rms [px]",
        "largest [px]",
        "kept [%]",
        "swaps",
        "plain: kept [%]",
        "swaps",
        "markers swapped at the end",
    )
    for count in (REST + 60, REST + 10, REST + 4, REST + 2):
        found = [
            both(clips.slide(clips.field(), k * np.pi / 4, count=count, rest=REST), clips.DEFAULT) for k in range(8)
        ]
        own, plain = ([pair[i] for pair in found] for i in (0, 1))
        line(count - REST, _rms(own), max(s.worst for s in own), percent(np.mean([s.kept for s in own])),
             sum(s.swapped for s in own), percent(np.mean([s.kept for s in plain])), sum(s.swapped for s in plain),
             sum(s.swapped_last for s in plain))  # fmt: skip


def _rms(scores) -> float:
    return float(np.sqrt(np.mean([s.rms**2 for s in scores])))


def bad(seed: int = 10) -> None:
    """Share kept and identities on bad clips."""
    head(
        "clip",
        "clips",
        "marker-frames",
        "kept [%]",
        "worst clip [%]",
        "stray",
        "swaps",
        "rms [px]",
        "plain: kept [%]",
        "swaps",
    )
    small = clips.with_look(clips.BAD, radius=4.0)
    cases = {
        "dark markers, 81 in rings": (clips.field(), clips.BAD, "rings", 40.0),
        "bright markers, 81 in rings": (clips.field(), WORST, "rings", 40.0),
        "dark markers, 127 hexagonal": (clips.field(layout="hex", rings=6), small, "hex", 30.0),
        "dark markers, pressed": (clips.field(), clips.BAD, "rings", None),
    }
    for name, (points, look, layout, travel) in cases.items():
        own, plain, count = [], [], 0
        for k in range(0, 8, 2):
            path = (
                clips.press(points, count=120) if travel is None else clips.slide(points, k * np.pi / 4, travel=travel)
            )
            pair = both(path, look, seed=seed + k, layout=layout)
            own.append(pair[0])
            plain.append(pair[1])
            count += path.shape[0] * path.shape[1]
        line(name, len(own), count, percent(np.mean([s.kept for s in own])), percent(min(s.kept for s in own)),
             sum(s.stray for s in own), sum(s.swapped for s in own), _rms(own),
             percent(np.mean([s.kept for s in plain])), sum(s.swapped for s in plain))  # fmt: skip


def vanish() -> None:
    """Markers that vanish for a while during a slide."""
    head(
        "frames hidden",
        "markers hidden",
        "found in hidden frames",
        "frames until found again",
        "kept of the rest [%]",
        "swaps",
    )
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


def drift() -> None:
    """Drift over an hour of rest at 30 frames a second, of which every 600th frame is made and tracked."""
    head("light", "frames tracked", "largest drift of a marker [px]", "rms drift [px]", "noise of a frame [px]")
    for name, look in (
        ("steady", clips.DEFAULT),
        ("loses 30 %, flickers 2 %", clips.with_look(clips.DEFAULT, drift=0.3, flicker=0.02)),
    ):
        positions = clips.still(clips.field(), 180)
        found = ours(list(clips.filmed(positions, look)), positions, n_markers=81)
        moved = np.nanmean(found[-36:], axis=0) - np.nanmean(found[:36], axis=0)
        line(
            name,
            len(found),
            float(np.linalg.norm(moved, axis=1).max()),
            float(np.sqrt((moved**2).mean())),
            float(np.nanstd(found - positions)),
        )


def speed() -> None:
    """CPU time of a frame of 1920 x 1080 with 81 markers."""
    look = clips.Look(shape=(1080, 1920), radius=10.0)
    positions = clips.slide(clips.field(look), 1.0, count=200, rest=REST)
    with tempfile.TemporaryDirectory() as folder:
        video = Path(folder) / "clip.avi"
        write_video(video, clips.filmed(positions, look), RATE)
        frames = list(open_frames(video).read())
        reference = reference_of(first_frames(frames, 10)[0], None, 81, "rings", None, "clip")
        follow(reference.markers, rest_state(reference.markers), frames[0], None)
        head("part", "CPU ms a frame", "frames a second")
        parts = {"follow 81 markers": _timed(lambda: _follow(reference, frames), len(frames))}
        rest = rest_exposure(frames[0])
        parts["judge the exposure"] = _timed(
            lambda: [frame_state(b, a, rest) for a, b in itertools.pairwise(frames)], len(frames)
        )
        parts["decode MJPEG"] = _timed(lambda: sum(1 for _ in open_frames(video).read()), len(frames))
        parts["all three"] = sum(parts.values())
        for name, seconds in parts.items():
            line(name, 1e3 * seconds, 1.0 / seconds)
        whole = _timed(lambda: fs.track_markers(video, n_markers=81, rest_frames=REST), len(frames))
        line(f"track_markers, {len(frames)} frames with the first search", 1e3 * whole, 1.0 / whole)
        start = positions[0]
        plain = _timed(lambda: track_nearest(frames[:20], start, look.radius), 20)
        line("plain tracker, without decoding", 1e3 * plain, 1.0 / plain)


def _follow(reference, frames) -> None:
    state = rest_state(reference.markers)
    for frame in frames:
        state, _, _ = follow(reference.markers, state, frame, None)


def _timed(call, count) -> float:
    best = np.inf
    for _ in range(3):
        start = time.process_time()
        call()
        best = min(best, time.process_time() - start)
    return best / count


CASES = {case.__name__: case for case in (error, directions, bad, vanish, drift, speed)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", nargs="*", choices=CASES, default=list(CASES))
    parser.add_argument("--seed", type=int, default=10, help="first seed of the bad clips")
    cv2.setNumThreads(1)
    given = parser.parse_args()
    for name in given.cases:
        sys.stdout.write(f"\n{CASES[name].__doc__}\n")
        bad(given.seed) if name == "bad" else CASES[name]()


if __name__ == "__main__":
    main()
