"""Stored results seen: one figure or film for ``fingerslip figure``, a window, picture or film for ``view``."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fingerslip.detect.folders import OF_CLIPS, OF_EVALUATIONS, check_kind, kinds_of
from fingerslip.errors import InputError, ResultError
from fingerslip.history import is_solid, phase_times, read_history
from fingerslip.libraries import xr
from fingerslip.marker_tracks import marker_tracks
from fingerslip.parameters import from_mapping
from fingerslip.published import published_set
from fingerslip.report.content import (
    MOST_RUNS,
    OF_RUNS,
    OF_STUDIES,
    RUN_FIGURES,
    STUDY_FIGURES,
    STYLES,
    RunSubject,
    StudySubject,
    check_subject,
    check_times,
)
from fingerslip.report.labels import run_title
from fingerslip.report.scene.names import CAMERAS, CUTS, FIELDS
from fingerslip.report.scene.options import SceneOptions, Served, require_free
from fingerslip.report.tables.runs import swept_paths
from fingerslip.results import (
    ABOUT,
    HISTORY,
    RESULT,
    SAMPLE,
    RunResult,
    StudyResult,
    stored_fit,
    stored_result,
    without_results,
)
from fingerslip.slip import find_events
from fingerslip.slip.windows import LATENCY
from fingerslip.study.inspection.show import sensitivities
from fingerslip.study.storage.reporting import reactions_of, read_results, read_stored_run, slide_starts
from fingerslip.study.storage.store import read_manifest
from fingerslip.units import parse_quantity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Formats of figures; the kind that is a film, the one that a detector draws, those that say their run.
FORMATS, FILM, DETECTOR, TITLED = ("pdf", "svg", "png"), "film", "detector", ("composed", "spikes")
# OpenCV brings an encoder for it, and browsers play it.
_CODEC, _MP4 = "vp09", ".mp4"


_OF_REACTIONS = {
    "reaction-map": "longest latency that saves a held object, over friction and rate of the load",
    "reaction-margin": "that latency against the rate of the load, and the travel that a latency costs",
    "reaction-outcome": "what comes of each reaction after each detector",
}
_OF_FITS = {
    "posterior": "what a fit says of each value and of each pair",
    "fit": "measured curves, the first six, with those of the fitted model, and residuals",
}
_OF_WHOLE, _OVER = (*OF_STUDIES, *_OF_REACTIONS, *_OF_FITS), ("latency", "events")


@dataclass(frozen=True)
class FigureChoice:
    """Which figure is wanted, and how it looks."""

    kind: str  # its name
    style: str = "paper"  # one of :data:`fingerslip.report.content.STYLES`
    form: str = "pdf"  # one of :data:`FORMATS`; films are ``mp4``
    run: str = ""  # name of the run, of a study with several
    path: str = ""  # dotted path of the swept value on the axis
    times: Sequence[str] = ()  # times with their units
    options: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    film: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    dpi: int | None = None  # dots per inch of pixels


def kinds_text(target: Path | None = None) -> str:
    """Return the kinds of figures with what they show, in lines: those that a folder has something for, or all."""
    others = {DETECTOR: "what the detector that ships finds in a sensor's markers", FILM: "a film, as MP4"}
    every = {**OF_STUDIES, **_OF_REACTIONS, **_OF_FITS, **OF_RUNS, **others, **OF_EVALUATIONS, **OF_CLIPS}
    of_detector = {} if target is None else kinds_of(target)
    kinds = every if target is None else of_detector or _result_kinds(target)
    return "\n".join(f"{name}: {of_detector.get(name, words)}" for name, words in every.items() if name in kinds)


def _result_kinds(target: Path) -> set[str]:
    """Return the kinds of figures of the run that is shown without a name, and of its study."""
    study = None if (target / RESULT).is_file() else read_results(target)
    history = read_history(_run_folder(target, with_run(target, FigureChoice(FILM)).run) / HISTORY)
    kinds = {FILM, *(name for name in OF_RUNS if RUN_FIGURES[name].can_show(history))}
    if RUN_FIGURES["markers"].can_show(history) and phase_times(history, "hold"):
        kinds.add(DETECTOR)
    if study is not None:
        lacking = {"sensitivity"} if not study.design else set()
        lacking |= set(_OVER) if not _axis_paths(study) else set()
        kinds |= {name for name in OF_STUDIES if name not in lacking and STUDY_FIGURES[name].fits(history)}
        kinds |= _OF_FITS.keys() if (target / ABOUT).is_file() else set()
        if any(run.reaction for run in study.runs):
            from fingerslip.react.figures import reaction_figures

            kinds |= reaction_figures(reactions_of(study)).keys()
    return kinds


def film_options(size: str = "", rate: float | None = None, seconds: float | None = None) -> dict[str, Any]:
    """Return what is asked of a film; a size [pixels] is a text such as '1280x720'."""
    words = size.lower().split("x")
    if size and (len(words) != 2 or not all(part.isdigit() for part in words)):
        raise InputError("figure: --size", f"got '{size}'", "needs a width and a height in pixels", "write 1280x720")
    asked = {"size": tuple(map(int, words)) if size else None, "frame_rate": rate, "seconds": seconds}
    return {name: value for name, value in asked.items() if value is not None}


def _check_choice(choice: FigureChoice, of_detector: Mapping[str, str]) -> None:
    """Refuse names that no figure has, and options of other kinds."""
    allowed = {
        "--kind": (choice.kind, tuple(of_detector) or (*_OF_WHOLE, *OF_RUNS, DETECTOR, FILM)),
        "--style": (choice.style, STYLES),
        "--format": (choice.form, FORMATS),
    }
    for option, (value, names) in allowed.items():
        if value not in names:
            raise InputError(f"figure: {option}", f"got '{value}'", f"needs one of {', '.join(names)}")
    of_film = next(iter(choice.film), "").removeprefix("frame_")
    for option, chosen, kinds in ((of_film, choice.film, (FILM,)), ("over", choice.path, _OVER)):
        if chosen and choice.kind not in kinds:
            fault, needs = f"does not fit --kind {choice.kind}", f"needs --kind {' or '.join(kinds)}"
            raise InputError(f"figure: --{option}", fault, needs, "leave it out")


def write_figure(target: Path, choice: FigureChoice, output: Path | None = None) -> Path:
    """Write a figure or a film of stored results."""
    check_kind(target, choice.kind)
    of_detector = kinds_of(target)
    _check_choice(choice, of_detector)
    if of_detector:
        return _save_of_detector(target, choice, output)
    if choice.kind in _OF_WHOLE and choice.run:
        fault = f"got '{choice.run}' with --kind {choice.kind}"
        raise InputError("figure: --run", fault, "needs a kind that shows one run", "leave it out: all runs are shown")
    check_times(choice.kind, choice.times, "figure: --time")
    choice = with_run(target, choice)
    named = f"{choice.kind}-{choice.run}" if choice.run else choice.kind
    path = output or target / f"{named}{_MP4 if choice.kind == FILM else f'.{choice.form}'}"
    if choice.kind == FILM and path.suffix.lower() != _MP4:
        raise InputError("figure: --output", f"got '{path}'", f"needs a name that ends in {_MP4}", "films are MP4")
    if choice.kind in (*_OF_REACTIONS, *_OF_FITS):
        return _save(_results_figure(target, choice.kind), path, choice)
    if choice.kind in OF_STUDIES:
        study = _study_subject(target, choice)
        from fingerslip.report.page.pictures import draw_of_study

        return _save(functools.partial(draw_of_study, choice.kind, study), path, choice)
    run = _run_subject(_run_folder(target, choice.run), choice)
    with _one_scale(target, choice, run):
        if choice.kind == FILM:
            return _write_film(run, path, choice)
        from fingerslip.report.page.pictures import draw_of_run

        draw = _detector_figure if choice.kind == DETECTOR else functools.partial(draw_of_run, choice.kind)
        return _save(functools.partial(draw, run), path, choice)


#: Kinds whose colours show a field; of the runs of a study they have one scale.
_OF_FIELDS = ("composed", "deformed", "cut", "forces", FILM)


def _one_scale(target: Path, choice: FigureChoice, run: RunSubject) -> contextlib.AbstractContextManager[None]:
    """Give the colours of a field the same range for all runs of a study, the first of many."""
    if choice.kind not in _OF_FIELDS:
        return contextlib.nullcontext()
    from fingerslip.report.scene.scene import one_scale

    folder, name = (target, choice.run) if choice.run else (target.parent, target.name)

    def histories() -> Iterator[xr.Dataset]:
        yield run.history
        for other in list(read_manifest(folder).get("runs", {}))[:MOST_RUNS]:
            with contextlib.suppress(ResultError):  # one that cannot be read is left out
                if other != name:
                    yield read_history(folder / other / HISTORY)

    return one_scale(histories(), run.options)


def _save(draw_figure: Callable[[], Figure], path: Path, choice: FigureChoice) -> Path:
    # Libraries that draw are slow to load: what is wrong with the results is said before.
    from fingerslip.report.figures.style import looking, save_figure

    with looking(choice.style):
        save_figure(draw_figure(), path, choice.dpi)
    return path


def _save_of_detector(target: Path, choice: FigureChoice, output: Path | None) -> Path:
    """Write a figure of an evaluation of detectors, of a clip that one ran on, or of tracks."""
    for option, value in {"--run": choice.run, "--over": choice.path, "--time": choice.times}.items():
        if value:
            raise InputError(f"figure: {option}", f"does not fit --kind {choice.kind}", "needs none", "leave it out")
    from fingerslip.detect.page import draw

    folder = target.parent if target.is_file() else target
    return _save(lambda: draw(target, choice.kind), output or folder / f"{choice.kind}.{choice.form}", choice)


def with_run(target: Path, choice: FigureChoice) -> FigureChoice:
    """Name the run of a figure that shows one: of several the one in the middle, which figure and file then say."""
    runs = list(read_manifest(target).get("runs", {}))
    if choice.kind in _OF_WHOLE or choice.run or len(runs) < 2:
        return choice
    return dataclasses.replace(choice, run=runs[len(runs) // 2])


def _results_figure(target: Path, kind: str) -> Callable[[], Figure]:
    """Return what draws a figure of a study with the block `reaction`, or of a fit."""
    study = read_results(target)
    if kind in _OF_FITS:
        stored_fit(study)
        from fingerslip.study.fit import stored_figure

        return functools.partial(stored_figure, target, kind)
    needs = "needs results of a study with the block reaction"
    if any(run.reaction for run in study.runs):
        from fingerslip.react.figures import reaction_figures

        reactions = reactions_of(study)
        figures = reaction_figures(reactions)
        if kind in figures:
            return functools.partial(figures[kind], reactions)
        needs = f"needs one of {', '.join(figures)}"
    raise InputError("figure: --kind", f"got '{kind}', of which {target} has nothing", needs)


def _detector_figure(subject: RunSubject) -> Figure:
    """Draw what the detector that ships finds in the markers of a run from the hold before its slide on."""
    from fingerslip.detect.page import SlipClip, timeline_of
    from fingerslip.detect.residual import ResidualSettings, detect_residual, findings_table, frames_at_rest
    from fingerslip.detect.timeline import timeline_figure
    from fingerslip.report.figures.style import with_style
    from fingerslip.report.figures.time_axis import limit_to_slides, mark_panels

    history, holds = subject.history, phase_times(subject.history, "hold")
    if not holds:
        fault, mend = "has no hold before its slide", "write hold: {duration: 1 s} into its programme and run again"
        raise InputError("figure: the run", fault, "needs markers at rest first", mend)
    tracks = marker_tracks(history).sel(time=slice(holds[0][0], None))
    findings = detect_residual(tracks, ResidualSettings(rest_frames=frames_at_rest(tracks)))
    clip = SlipClip(subject.title or "the run", tracks, findings, findings_table(findings, "", ""))
    figure = timeline_figure(timeline_of(clip))
    limit_to_slides(figure.axes[0], {"": history}, {"": subject.events}, marked=[subject.events.slip])
    with_style(mark_panels)(figure.axes, history, subject.events.slip)
    return figure


def _study_subject(target: Path, choice: FigureChoice) -> StudySubject:
    if not read_manifest(target).get("runs"):
        lacks = "holds no study; this figure needs the folder of a study that fingerslip run wrote"
        raise ResultError(f"{target}: {without_results(target, lacks)}")
    study = read_results(target)
    paths = _axis_paths(study)
    if choice.path and choice.path not in paths:
        needs = f"one of {', '.join(paths)}" if paths else "a study with a sweep"
        raise InputError("figure: --over", f"'{choice.path}' is not swept", f"needs {needs}")
    with_panels = () if choice.kind in {*_OVER, "sensitivity"} else study.runs[:MOST_RUNS]
    drawn = {run_title(run, "the run"): run for run in with_panels}
    references = [published_set(name) for name in study.compare]
    values = tuple(value for reference in references for value in reference.values)
    path = choice.path or (paths[0] if paths else "")
    runs: Sequence[RunResult] = study.runs
    if path in study.ranges:  # a sampled value stands in the place of the number of its sample
        others = [{name: value for name, value in run.swept.items() if name != SAMPLE} for run in runs]
        runs = [
            dataclasses.replace(run, swept={**swept, path: run.sampled[path]})
            for run, swept in zip(runs, others, strict=True)
        ]
    subject = StudySubject(
        runs=runs,
        histories={title: read_history(study.folder / run.name / HISTORY) for title, run in drawn.items()},
        events={title: run.events for title, run in drawn.items()},
        reference=dataclasses.replace(references[0], values=values) if references else None,
        starts=slide_starts(study),
        path=path,
        sensitivities=sensitivities(study, LATENCY) if choice.kind == "sensitivity" else (),
    )
    check_subject(choice.kind, subject)
    return subject


def _axis_paths(study: StudyResult) -> list[str]:
    """Return the dotted paths of what differs between the runs of a study, sampled values first."""
    swept = (path for path in swept_paths(study.runs) if len({str(run.swept.get(path)) for run in study.runs}) > 1)
    return [*study.ranges, *swept]


def _run_folder(target: Path, name: str) -> Path:
    """Return the folder of the run: the named one, or the only one."""
    names = list(read_manifest(target).get("runs", {}))
    if not names and name not in ("", target.name):
        raise InputError("figure: --run", f"got '{name}' with the folder of a run", "needs the folder of its study")
    if not names:
        return target
    if name and name not in names:
        raise InputError("figure: --run", f"'{name}' is not there", f"needs one of {', '.join(names)}")
    return target / (name or names[0])


def _run_subject(folder: Path, choice: FigureChoice) -> RunSubject:
    # What knows how a body is seen loads the contact patch and its libraries.
    from fingerslip.report.scene.scene import middle_cut

    result, history = read_stored_run(folder), read_history(folder / HISTORY)
    opened = (
        {"cut": middle_cut(history), "receptors": False} if is_solid(history) and "camera" not in choice.options else {}
    )
    options = _scene_options({"written": False, **opened, **choice.options}, "figure")
    times = tuple(time_of_run(history, time, "figure: --time") for time in choice.times)
    title = run_title(result, "") if choice.kind in TITLED and choice.run else ""
    subject = RunSubject(history, result.events, options, times, title=title)
    if choice.kind in OF_RUNS:
        check_subject(choice.kind, subject)
    return subject


def _scene_options(options: Mapping[str, Any], command: str) -> SceneOptions:
    """Return what a command line wants of a scene; messages name its options."""
    for name, allowed in {"scalar": FIELDS, "cut": CUTS, "camera": CAMERAS}.items():
        if (value := options.get(name, allowed[0])) not in allowed:
            option = "field" if name == "scalar" else name
            raise InputError(f"{command}: --{option}", f"got '{value}'", f"needs one of {', '.join(allowed)}")
    return from_mapping(SceneOptions, dict(options), command)


def _write_film(subject: RunSubject, path: Path, choice: FigureChoice) -> Path:
    import matplotlib as mpl

    from fingerslip.report.figures.motion import Film, film_frames
    from fingerslip.vision.video import write_video

    film = Film(**choice.film)
    # Films show numbers by pixels, whatever the user's own settings of figures are.
    with mpl.rc_context():
        frames = film_frames(subject.history, subject.events, subject.options, film)
        write_video(path, (frame[..., ::-1] for frame in frames), film.frame_rate, codec=_CODEC)
    return path


def view_result(
    target: str | Path,
    options: Mapping[str, Any],
    *,
    time: str = "",
    screenshot: Path | None = None,
    movie: Path | None = None,
    served: Served | None = None,
) -> tuple[Path, ...]:
    """Show a stored run."""
    chosen = _scene_options(options, "view")
    if served is not None:
        require_free(served)
    history = _stored_history(Path(target))
    moment = time_of_run(history, time, "view: --time") if time else None
    # Libraries that draw are slow to load: what is wrong with the result is said before.
    from fingerslip.report.scene.viewer import open_window, save_movie, save_still

    if screenshot is not None:
        save_still(history, screenshot, moment, chosen)
    if movie is not None:
        save_movie(history, movie, chosen)
    written = tuple(path for path in (screenshot, movie) if path is not None)
    if written:
        return written
    events, title = find_events(history), f"fingerslip: {target}"
    if served is None:
        open_window(history, chosen, title, events)
    else:
        from fingerslip.report.scene.web import serve

        serve(history, events, chosen, title, served)
    return ()


def _stored_history(target: Path) -> xr.Dataset:
    """Read the history of a file, of a run, or of the only run of a study."""
    if target.is_file():
        return read_history(target)
    runs = [target] if (target / HISTORY).is_file() else sorted(path.parent for path in target.glob(f"*/{HISTORY}"))
    if not runs:
        raise ResultError(f"{target}: holds no run; needs a folder that fingerslip run wrote")
    if len(runs) > 1:
        needed = f"needs one of {', '.join(folder.name for folder in runs)}"
        raise InputError(str(target), f"holds {len(runs)} runs", needed, "name its folder")
    if (runs[0] / RESULT).exists():
        stored_result(runs[0])  # a history that is known to be damaged is not read
    return read_history(runs[0] / HISTORY)


def time_of_run(history: xr.Dataset, text: str, where: str) -> float:
    """Return a time of a run [s]."""
    time, end = parse_quantity(text, "s", where=where), float(history["time"].values[-1])
    if not 0.0 <= time <= end:
        raise InputError(where, f"got {text}", f"needs a time of the run, 0 to {end:.4g} s")
    return time
