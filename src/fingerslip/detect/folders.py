"""What is in the folders of detectors and of tracks, and which figures they have."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from fingerslip.errors import InputError, ResultError
from fingerslip.storage.files import read_json

#: Endings of the names of files that hold tracks.
TRACK_FILES = (".nc", ".csv")
#: Files of an evaluation and of a clip that their figures are drawn of.
JUDGED, CLIP = "judged.npz", "clip.json"
#: How a damaged folder of a clip is mended.
AGAIN = "run fingerslip detect run again"
#: Kinds of figures of an evaluation, and of a clip that a detector ran on, with what they show.
OF_EVALUATIONS: Mapping[str, str] = {
    "confusion": "frames, or whole trials, by true class and by the class found, in per cent of each row",
    "roc": "slip found over false alarms as the threshold falls, each frame or whole trial by itself",
    "calibration": "how often it slips over the probability that is said",
    "leads": "share of the trials in which slip was found so long before gross slip; early alarms have no lead",
    "trials": "onsets of slip found in each trial, beside the labels",
}
OF_CLIPS: Mapping[str, str] = {"slip-timeline": "displacement, markers that left the pattern and slip over time"}
OF_TRACKS: Mapping[str, str] = {"markers": "displacements of the markers over time"}
#: What has no figure itself, by a file that is in it.
_WITHOUT = {"detector.json": "is a detector", "*/provenance.json": "is a data set"}
_FOLDERS = {
    JUDGED: (OF_EVALUATIONS, "fingerslip detect evaluate", "evaluation.html"),
    CLIP: (OF_CLIPS, "fingerslip detect run", "slip.html"),
}


def kinds_of(folder: Path) -> Mapping[str, str]:
    """Return the kinds of figures of what a detector or the tracker wrote, with what they show; none of others."""
    of_tracks = OF_TRACKS if tracks_in(folder).is_file() else {}
    for file, (kinds, verb, page) in _FOLDERS.items():
        if (folder / file).is_file():
            return {**kinds, **of_tracks}
        if (folder / page).is_file():
            fault = f"has a page, but no {file}: an older version wrote it"
            raise InputError(str(folder), fault, "needs it for figures", f"run {verb} again")
    for file, fault in _WITHOUT.items():
        if any(folder.glob(file)):
            needed = "needs the folder that fingerslip detect evaluate, detect run or track wrote"
            raise InputError(f"figure: {folder}", fault, needed, "name that one")
    return of_tracks


def tracks_in(target: Path) -> Path:
    """Return the file of tracks that a target is, or holds where it is a folder that the tracker wrote."""
    return target if target.suffix in TRACK_FILES else target / "tracks.nc"


def check_kind(folder: Path, kind: str) -> None:
    """Refuse a kind of figure that other folders have than this one."""
    for kinds, verb, _ in _FOLDERS.values():
        if kind in kinds and kind not in kinds_of(folder):
            allowed = f"needs the folder that {verb} wrote"
            raise InputError(f"figure: {folder}", f"has no figure {kind}", allowed, "name that one")


def origin_of(folder: Path) -> dict[str, str]:
    """Return the source and the detector of what a folder holds; nothing where that is not known."""
    try:
        described = read_json(folder / CLIP, AGAIN)
        return {name: str(described[name]) for name in ("source", "detector")}
    except (OSError, ResultError, KeyError):
        return {}
