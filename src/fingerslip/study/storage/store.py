"""The folders of a study: a run is there whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import shutil
import time
from collections.abc import Iterator, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

from fingerslip.errors import ResultError
from fingerslip.mesh.scan.build import SurfaceMesh
from fingerslip.study.definition.spec import MeshFile
from fingerslip.study.definition.sweep import Run
from fingerslip.study.running.build import mesh_key

__all__ = [
    "RESULT_FORMAT",
    "clean_stale",
    "identity",
    "mapping_text",
    "new_folder",
    "read_result",
    "remove_empty",
    "write_text",
    "writing",
]

#: Raised whenever the numerics or the files of a run change, so that older runs are computed again.
RESULT_FORMAT = 4

_FULL = {errno.ENOSPC, errno.EDQUOT}
_DAY = 86400.0


def identity(run: Run) -> str:
    """Return the hash of everything that decides the result of a run: its values, its mesh files, the program."""
    values = {key: value for key, value in run.resolved().items() if key != "title"}
    if isinstance(run.study.mesh, MeshFile | SurfaceMesh):
        values["mesh"] = {"hash": mesh_key(run)}
    made_by = {"format": RESULT_FORMAT, "version": metadata.version("fingerslip")}
    text = json.dumps([made_by, values], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def read_result(folder: Path) -> dict[str, Any] | None:
    """Read what is stored beside the history of a finished run; None where there is no finished run."""
    try:
        result: dict[str, Any] = json.loads((folder / "events.json").read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError):
        return None
    return result if (folder / "history.nc").is_file() else None


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn the operating system's refusals to write into errors that say what to do.

    Raises
    ------
    ResultError
        Where the disk is full or nothing may be written at `path`.
    """
    try:
        yield
    except OSError as error:
        mend = "free some space" if error.errno in _FULL else "give write access"
        reason = error.strerror or str(error)
        raise ResultError(f"{path}: cannot be written ({reason}); {mend} or choose another folder") from error


@contextlib.contextmanager
def new_folder(final: Path) -> Iterator[Path]:
    """Give a temporary folder that takes the name `final` when the block ends, and is removed when it fails.

    What was there under that name is replaced only when the new folder is whole.

    Raises
    ------
    ResultError
        Where the folder cannot be made or renamed.
    """
    partial = final.with_name(f".{final.name}.{os.getpid()}.partial")
    try:
        with writing(final.parent):
            partial.mkdir(parents=True)
        yield partial
        with writing(final.parent):
            _replace(partial, final)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all.

    Raises
    ------
    ResultError
        Where it cannot be written.
    """
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with writing(path):
            partial.write_text(text, encoding="utf-8")
            partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def clean_stale(folder: Path) -> None:
    """Remove what processes that are gone left unfinished in `folder`, and put back what they had moved away."""
    if not folder.is_dir():
        return
    for old in folder.glob(".*.old"):
        final = old.with_name(_final_name(old))
        if _is_stale(old) and not final.exists():
            old.rename(final)
    for left in (*folder.glob(".*.partial"), *folder.glob(".*.old")):
        if _is_stale(left):
            _remove(left)


def remove_empty(*folders: Path) -> None:
    """Remove folders that hold nothing, the innermost first."""
    for folder in folders:
        with contextlib.suppress(OSError):
            folder.rmdir()


def mapping_text(values: Mapping[str, Any]) -> str:
    """Write plain data as JSON that people can read."""
    return json.dumps(values, indent=2, ensure_ascii=False) + "\n"


def _replace(new: Path, final: Path) -> None:
    old = final.with_name(f".{final.name}.{os.getpid()}.old")
    if final.exists():
        final.rename(old)
    new.rename(final)
    shutil.rmtree(old, ignore_errors=True)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _final_name(temporary: Path) -> str:
    return temporary.name[1:].rsplit(".", 2)[0]


def _is_stale(temporary: Path) -> bool:
    process = temporary.name.rsplit(".", 2)[-2]
    return process.isdigit() and not _is_alive(int(process), temporary)


def _is_alive(process: int, temporary: Path) -> bool:
    if process == os.getpid():
        return False
    if os.name != "posix":  # there is no harmless signal to ask with
        return time.time() - temporary.stat().st_mtime < _DAY
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
