"""Cases of tracks and detectors: units and names changed, containers opened, checksums renewed after the damage."""

import io
import json
import random
import shutil
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from fingerslip.detect.live import run_on_tracks
from fingerslip.detect.model_file import read_detector, write_detector
from fingerslip.detect.recordings import read_any_tracks
from fingerslip.detect.synthetic import synthetic_slides
from fingerslip.detect.training import detect, train
from fingerslip.detect.trials import open_trials, write_trials
from fingerslip.storage.files import file_digest, read_json, write_json
from fingerslip.vision.tracks import read_tracks, read_tracks_csv, write_tracks_csv
from robustness.mutants import FOREIGN, changed_bytes, changed_data
from unit.detect.conftest import MOTION, SAMPLING

_UNITS = ("s", "ms", "m", "mm", "px", "deg", "rad", "furlong", "", "1", 3, "m m", "s^-1")
_TYPES = ("f4", "i1", "i8", "U8", "?")


def track_cases(folder: Path) -> Callable[[random.Random], None]:
    """Return what runs a case: tracks of which labels, units or bytes are changed are read and given to a detector."""
    detector, tracks = _learned(folder, "time_threshold")
    write_detector(detector, folder / "detector")
    write_tracks_csv(tracks, folder / "whole.csv")

    def case(chance: random.Random) -> None:
        path = folder / f"mutant.{chance.choice(('nc', 'csv'))}"
        if path.suffix == ".csv":
            path.write_bytes(_other_table((folder / "whole.csv").read_bytes(), chance))
            read_tracks_csv(path)
        else:
            # What netCDF itself refuses is no case.
            try:
                with warnings.catch_warnings(action="ignore"):
                    _other_tracks(tracks, chance).to_netcdf(path)
            except (ValueError, TypeError):
                return
            if chance.random() < 0.3:
                path.write_bytes(changed_bytes(path.read_bytes(), chance))
            read_tracks(path)
        list(run_on_tracks(read_detector(folder / "detector"), read_any_tracks(path)))

    return case


def detector_cases(folder: Path) -> Callable[[random.Random], None]:
    """Return what runs a case: a detector of which the inside is changed, its checksum renewed, is read and used."""
    whole = {}
    for name in ("forest", "boosting", "logistic"):
        whole[name], tracks = _learned(folder, name)
        write_detector(whole[name], folder / name)
    answers = {name: detect(detector, tracks)[1] for name, detector in whole.items()}

    def case(chance: random.Random) -> None:
        name, mutant = chance.choice(sorted(whole)), folder / "mutant."
        shutil.rmtree(mutant, ignore_errors=True)
        shutil.copytree(folder / name, mutant)
        model = next(mutant.glob("*.skops"))
        was = model.read_bytes()
        model.write_bytes(_other_container(was, chance))
        described = read_json(mutant / "detector.json", "")
        if chance.random() < 0.3:
            described = changed_data(described, chance)
        if isinstance(described, dict):
            write_json(mutant / "detector.json", described | {"sha256": file_digest(model)})
        answer = detect(read_detector(mutant), tracks)[1]
        assert answer.shape == answers[name].shape
        assert np.isfinite(answer).all()

    return case


def _learned(folder: Path, name: str) -> tuple[Any, xr.Dataset]:
    if not (folder / "slides").is_dir():
        slides = synthetic_slides((3e-3,), directions=4, repeats=1, seed=1, travel=8e-3)
        write_trials(slides, folder / "slides", "Slides")
    trials = open_trials(folder / "slides")
    return train(trials, trials.onsets(), name, motion=MOTION, sampling=SAMPLING), trials.tracks(trials.names[0])


def _other_tracks(tracks: xr.Dataset, chance: random.Random) -> xr.Dataset:
    tracks, name = tracks.copy(deep=True), chance.choice(sorted(map(str, tracks.variables)))
    match chance.randrange(7):
        case 0:
            tracks[name].attrs["units"] = chance.choice(_UNITS)
        case 1:
            tracks = tracks.rename({name: chance.choice(FOREIGN)})
        case 2:
            tracks = tracks.drop_vars(name)
        case 3:
            tracks[name] = tracks[name].dims, tracks[name].values.astype(chance.choice(_TYPES))
        case 4:
            tracks = tracks.isel({chance.choice(list(tracks.dims)): slice(0, chance.choice((0, 1, 2)))})
        case 5:
            tracks.attrs[chance.choice([*map(str, tracks.attrs), *FOREIGN])] = chance.choice((*FOREIGN, 0, -1.0))
        case _:
            values = tracks["position"].values
            values[chance.randrange(len(values))] = chance.choice((np.nan, np.inf, 1e300, -1e-300))
    return tracks


def _other_table(content: bytes, chance: random.Random) -> bytes:
    head, _, rest = content.partition(b"\n")
    names = head.split(b",")
    place = chance.randrange(len(names))
    match chance.randrange(4):
        case 0:
            names[place] = chance.choice(FOREIGN).encode()
        case 1:
            names[place] = chance.choice(names)
        case 2:
            return content[: chance.randrange(len(head) + 1)]
        case _:
            return changed_bytes(content, chance)
    return b",".join(names) + b"\n" + rest


def _other_container(content: bytes, chance: random.Random) -> bytes:
    """Return a zip file with members changed, dropped, renamed, repeated or of other numbers."""
    if chance.random() < 0.2:
        return changed_bytes(content, chance)
    with zipfile.ZipFile(io.BytesIO(content)) as packed:
        members = {member.filename: packed.read(member) for member in packed.infolist()}
    name = chance.choice(sorted(members))
    match chance.randrange(5):
        case 0:
            del members[name]
        case 1:
            members[chance.choice((*filter(None, FOREIGN), "../x", "/x"))] = members.pop(name)
        case 2:
            members[name] = chance.choice(list(members.values()))
        case 3:
            arrays = [other for other in sorted(members) if other.endswith(".npy")]
            members[chance.choice(arrays)] = _other_array(members[chance.choice(arrays)], chance)
        case _:
            schema = json.loads(members["schema.json"])
            members["schema.json"] = json.dumps(changed_data(schema, chance)).encode()
    packed_again = io.BytesIO()
    with zipfile.ZipFile(packed_again, "w") as packed:
        for member, data in members.items():
            packed.writestr(member, data)
    return packed_again.getvalue()


def _other_array(content: bytes, chance: random.Random) -> bytes:
    """Return the bytes of an array with numbers, its shape or its type changed."""
    array = np.load(io.BytesIO(content), allow_pickle=False).copy()
    flat = array.reshape(-1).view(np.uint8) if array.dtype.names else array.reshape(-1)
    with np.errstate(all="ignore"):
        match chance.randrange(3) if flat.size else 2:
            case 0:
                values = (0, 1, -1, 10**6, 2**31 - 1) if flat.dtype.kind in "iu" else (np.nan, np.inf, -1.0, 1e300, 0.0)
                flat[chance.randrange(flat.size)] = np.array(chance.choice(values)).astype(flat.dtype)
            case 1:
                array = array[: chance.randrange(len(array) + 1)] if array.ndim else array
            case _:
                array = array.astype(chance.choice(("f4", "i8"))) if not array.dtype.names else array[::-1]
    written = io.BytesIO()
    np.save(written, array)
    return written.getvalue()
