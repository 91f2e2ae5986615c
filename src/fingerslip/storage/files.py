"""Hashes, and files written whole or not at all; JSON with a checksum.

Files and folders that are there whole or not at all: the only place that writes results.

What is being written has a temporary name beside the final one, ``.NAME.TOKEN.partial`` and the ending of the
file. It takes the final name when it is whole, and is removed when writing it fails. Whoever writes it holds a lock on
``.NAME.TOKEN.lock`` meanwhile, which the system gives back when its process ends: so what nobody writes any more is
known in other threads, containers and machines, where the number of a process says nothing.
"""

from __future__ import annotations

import contextlib
import csv
import errno
import functools
import glob
import hashlib
import io
import itertools
import json
import os
import re
import secrets
import shutil
import socket
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pydantic

from fingerslip.errors import DamagedError, InputError, ResultError
from fingerslip.libraries import pd


def digest(*parts: Any) -> str:
    """Return the SHA-256 hash of arrays, bytes and plain data, in this order; the order of keys does not matter.

    Examples
    --------
    >>> digest({"a": 1, "b": [2, 3]}) == digest({"b": [2, 3], "a": 1})
    True
    """
    checksum = hashlib.sha256()
    for part in parts:
        match part:
            case bytes():
                content = part
            case np.ndarray():
                content = np.ascontiguousarray(part).tobytes()
            case _:
                content = json.dumps(part, sort_keys=True).encode()
        checksum.update(content)
    return checksum.hexdigest()


def file_digest(path: Path) -> str:
    """Return the SHA-256 hash of what is in a file; raise OSError where it cannot be read."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def check_digests(folder: Path, digests: Mapping[str, object], fault: str, repair: str) -> None:
    """Raise DamagedError, with a fault, where a file of a folder has another SHA-256 hash than was written of it."""
    for name, written in digests.items():
        try:
            is_same = file_digest(folder / name) == written
        except OSError as error:
            raise DamagedError(str(folder / name), f"cannot be read ({error.strerror})", repair) from error
        if not is_same:
            raise DamagedError(str(folder / name), fault, repair)


try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None  # type: ignore[assignment]


_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_FOLDER = {errno.EISDIR, errno.ENOTEMPTY}
# Of a writer whose lock cannot be seen from here; no run of a cluster may take longer.
_SECONDS_TO_WAIT = 7 * 86400.0
# How often a lock is tried whose file is taken away meanwhile: every time, another process has been inside.
_TRIES = 100_000
_CHECKSUM = "checksum"
_TEMPORARY = re.compile(r"(?P<stem>\.(?P<name>.+)\.(?:[0-9a-f]{8,16}|\d+))\.(?:partial(?:\.\w+)?|old|lock)")
# What spreadsheets take for a formula, and run, behind the apostrophes that tell them that it is text.
_FORMULA = re.compile(r"'*[=+\-@\t\r]")
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+(e[+-]?\d+)?\s*", re.IGNORECASE)


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn the operating system's refusals to write into errors that say what to do."""
    try:
        yield
    except OSError as error:
        repair = "free some space" if error.errno in _FULL else "give write access"
        if error.errno in _FOLDER:
            repair = "remove the folder of that name"
        reason = error.strerror or str(error)
        raise ResultError(f"{path}: cannot be written ({reason}); {repair} or choose another folder") from error


@contextlib.contextmanager
def new_file(final: Path) -> Iterator[Path]:
    """Give a temporary file name that becomes `final` when the block ends; nothing is left when it fails."""
    if final.exists() and not (final.is_file() or final.is_dir()):
        raise ResultError(f"{final}: is a device; needs the name of a file: give another one")
    with _partial(final, final.suffix) as partial, writing(final):
        yield partial
        partial.replace(final)


@contextlib.contextmanager
def new_files(final: Path) -> Iterator[Path]:
    """Give a temporary name in a folder of its own; the files written there move beside `final` when the block ends.

    For formats that come in several files, such as XDMF, whose files name each other.
    """
    with _partial(final) as partial, writing(final):
        partial.mkdir()
        yield partial / final.name
        for file in sorted(partial.iterdir(), key=lambda path: path.name == final.name):
            file.replace(final.with_name(file.name))


@contextlib.contextmanager
def new_folder(final: Path) -> Iterator[Path]:
    """Give a temporary folder that takes the name `final` when the block ends, and is removed when it fails.

    What was there under that name is replaced only when the new folder is whole.
    """
    with writing(final.parent):
        final.parent.mkdir(parents=True, exist_ok=True)
    clean_stale(final.parent, final.name)
    with _partial(final) as partial:
        with writing(final.parent):
            partial.mkdir()
        yield partial
        with writing(final.parent), alone(final.with_name(f".{final.name}.lock")):
            old = partial.with_suffix(".old")
            if final.exists():
                final.rename(old)
            partial.rename(final)
            shutil.rmtree(old, ignore_errors=True)


@contextlib.contextmanager
def alone(mark: Path) -> Iterator[None]:
    """Let one process at a time into the block, so that what one makes there, the others find.

    Whoever waits is let in when the process inside leaves, or ends for whatever reason. Where the system or the folder
    allows no lock, nobody waits: the block saves work, and must be right without it. `mark` is an empty file that is
    there meanwhile; its folder is made.
    """
    file = _lock(mark)
    try:
        yield
    finally:
        _unlock(mark, file)
        if file is not None:
            remove_empty(mark.parent)


def _lock(mark: Path) -> BinaryIO | None:
    """Return a file, open and locked, or None where no lock is to be had.

    The process inside takes the file away when it leaves. Whoever waited has then locked a file without a name, beside
    which others lock a new one, and tries again with the file that has the name.
    """
    for _ in range(_TRIES if fcntl is not None else 0):
        try:
            mark.parent.mkdir(parents=True, exist_ok=True)
            with contextlib.ExitStack() as unwanted:
                file = unwanted.enter_context(mark.open("ab"))
                fcntl.flock(file, fcntl.LOCK_EX)
                if os.path.samestat(os.fstat(file.fileno()), mark.stat()):
                    unwanted.pop_all()
                    return file
        except (FileExistsError, FileNotFoundError):  # the file is taken away meanwhile, and the folder with it
            continue
        except OSError:
            return None
    return None


def _unlock(mark: Path, file: BinaryIO | None) -> None:
    if file is not None:
        with contextlib.suppress(OSError), file:
            mark.unlink()


def check_replaceable(folder: Path, mark: str) -> None:
    """Refuse a folder for results that holds something else, or is a file, which would be lost."""
    check_folder(folder)
    if folder.is_dir() and any(folder.iterdir()) and not (folder / mark).is_file():
        fault, allowed = f"holds files, but no {mark}", "needs a new folder, or one of the same kind to replace"
        raise InputError(str(folder), fault, allowed, "give another name")


def check_folder(folder: Path) -> None:
    """Refuse a file where a folder is to be written, before anything is computed for it."""
    if folder.exists() and not folder.is_dir():
        raise InputError(str(folder), "is a file", "needs a folder", "give another name")


def folder_beside(path: Path, word: str, source_of: Callable[[Path], str]) -> Path:
    """Return the folder beside a file for what is made of it.

    Its name has the ending of the file, too, where that of another file is there, by what `source_of` says of a folder.
    """
    path = path if path.name not in ("", "..") else path.resolve()
    folder = path.with_name(f"{path.stem}_{word}")
    if not folder.is_dir() or Path(source_of(folder)).name in ("", path.name):
        return folder
    return path.with_name(f"{path.name.replace('.', '-')}_{word}")


def check_empty(folder: Path) -> None:
    """Refuse a folder that holds anything, or is a file: for forms in which others keep recordings of their own."""
    check_folder(folder)
    if folder.is_dir() and any(folder.iterdir()):
        raise InputError(str(folder), "holds files", "needs a new or an empty folder", "give another name")


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all; raise ResultError where it cannot be written."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all; raise ResultError where it cannot be written."""
    with new_file(path) as partial:
        partial.write_bytes(content)


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    """Write rows as CSV, with an apostrophe before text that a spreadsheet would run as a formula.

    Names in tables come from files of others. :func:`plain_cell` takes the apostrophe away.
    """
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([_safe_cell(cell) for cell in row] for row in rows)
    return stream.getvalue()


def frame_csv(frame: pd.DataFrame) -> str:
    """Write a data frame without its index as :func:`csv_text` writes rows."""
    texts = {name: frame[name].map(_safe_cell) for name in frame.select_dtypes(exclude=["number", "bool"]).columns}
    return str(frame.assign(**texts).rename(columns=_safe_cell).to_csv(index=False, lineterminator="\n"))


def check_decimals(path: Path) -> None:
    """Refuse a table with semicolons between columns or with commas in numbers, as spreadsheets may write it."""
    by_comma: list[list[str]] = [[]]
    by_semicolon = by_comma
    # What cannot be read at all is told by the reader.
    with contextlib.suppress(OSError, ValueError, csv.Error), path.open(encoding="utf-8-sig") as file:
        lines = [*itertools.islice((line for line in file if not line.startswith("#")), 2)] or [""]
        by_comma, by_semicolon = ([*csv.reader(lines, delimiter=mark, skipinitialspace=True)] for mark in ",;")
    has_semicolons = len(by_semicolon[0]) > len(by_comma[0])
    table = by_semicolon if has_semicolons else by_comma
    head, row = table[0], table[-1]
    # A row of one cell more than names may begin with its own name.
    is_wider = len(row) > len(head) + 1 and all(map(str.strip, row)) and re.search(r"\d,\d", ",".join(row)) is not None
    has_commas = is_wider or any(map(_DECIMAL_COMMA.fullmatch, row))
    faults = ["semicolons between its columns"] * has_semicolons + ["decimal commas"] * has_commas
    if faults:
        repair = "save it as CSV in English format" + ", or: sed 's/,/./g; s/;/,/g' old.csv > new.csv" * has_semicolons
        allowed = "needs commas between columns and points in numbers"
        raise InputError(str(path), f"has {' and '.join(faults)}", allowed, repair)


def plain_cell(text: str) -> str:
    """Return the text of a cell that :func:`csv_text` wrote."""
    return text[1:] if text.startswith("'") and _FORMULA.match(text) else text


def _safe_cell(value: Any) -> Any:
    if not isinstance(value, str) or not _FORMULA.match(value):
        return value
    with contextlib.suppress(ValueError):
        float(value)
        return value
    return f"'{value}"


def json_text(values: Mapping[str, Any]) -> str:
    """Write plain data as JSON that people can read."""
    return json.dumps(values, indent=2, ensure_ascii=False) + "\n"


def write_json(path: Path, values: Mapping[str, Any]) -> None:
    """Write plain data as JSON with a checksum, for :func:`read_json`; raise ResultError where it cannot be written."""
    write_text(path, json_text({**values, _CHECKSUM: digest(values)}))


def read_json(path: Path, repair: str, kind: pydantic.TypeAdapter[Any] | None = None) -> dict[str, Any]:
    """Read back what :func:`write_json` wrote, without its checksum; raise DamagedError where it is not of the kind."""
    try:
        text = path.read_text(encoding="utf-8")
        values = json.loads(text)
    except (FileNotFoundError, NotADirectoryError):
        raise FileNotFoundError(str(path)) from None
    except OSError as error:
        raise DamagedError(str(path), f"cannot be read ({error.strerror})", repair) from None
    except (ValueError, RecursionError):
        raise DamagedError(str(path), "is damaged: it is no JSON", repair) from None
    checksum = values.pop(_CHECKSUM, None) if isinstance(values, dict) else None
    if checksum is None:
        raise DamagedError(str(path), "has no checksum: it is damaged or of an earlier version", repair)
    if checksum != digest(values):
        raise DamagedError(str(path), "is damaged: its checksum is another", repair)
    try:
        mapping: dict[str, Any] = kind.validate_json(text, strict=True) if kind else values
    except pydantic.ValidationError as error:
        where = ".".join(map(str, error.errors()[0]["loc"]))
        raise DamagedError(str(path), f"is of another version, or damaged at {where}", repair) from None
    return mapping


def holds(path: Path, name: str, value: object) -> bool:
    """Tell whether a file that :func:`write_json` wrote is there, undamaged, with a value under a name."""
    try:
        return bool(read_json(path, "").get(name) == value)
    except (FileNotFoundError, DamagedError):
        return False


def clean_stale(folder: Path, name: str | None = None) -> None:
    """Remove what was left unfinished in `folder` by writers that are gone, and put back what they had moved away."""
    pattern = ".*" if name is None else f".{glob.escape(name)}.*"
    matches = [_TEMPORARY.fullmatch(path.name) for path in folder.glob(pattern)]
    for stem, final in {(match["stem"], match["name"]) for match in matches if match and name in (None, match["name"])}:
        # What cannot be removed, as by another user, does no harm.
        with contextlib.suppress(OSError), contextlib.ExitStack() as locks:
            if _has_no_writer(folder, stem, locks):
                _clear(folder, stem, folder / final)


def remove_empty(*folders: Path) -> None:
    """Remove folders that hold nothing, the innermost first."""
    for folder in folders:
        with contextlib.suppress(OSError):
            folder.rmdir()


@contextlib.contextmanager
def _partial(final: Path, suffix: str = "") -> Iterator[Path]:
    """Give the temporary name of what is to become `final`, locked in the block and removed at its end."""
    stem = f".{final.name}.{_system()}{secrets.token_hex(4)}"
    mark = final.with_name(f"{stem}.lock")
    file = _lock(mark) if final.parent.is_dir() else None
    try:
        yield final.with_name(f"{stem}.partial{suffix}")
    finally:
        _remove(final.with_name(f"{stem}.partial{suffix}"))
        _unlock(mark, file)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _clear(folder: Path, stem: str, final: Path) -> None:
    """Put back what a writer had moved away, and remove the rest that it left, its lock last."""
    old = folder / f"{stem}.old"
    if old.exists() and not final.exists():
        old.rename(final)
    for left in (*folder.glob(f"{glob.escape(stem)}.partial*"), old, folder / f"{stem}.lock"):
        _remove(left)


def _has_no_writer(folder: Path, stem: str, locks: contextlib.ExitStack) -> bool:
    """Tell whether nobody writes under a temporary name any more, and hold its lock as long as `locks`."""
    with contextlib.suppress(FileNotFoundError):
        file = locks.enter_context((folder / f"{stem}.lock").open("r+b"))
        if fcntl is not None:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
            except OSError:  # the file system has no locks
                pass
            else:
                if stem.rpartition(".")[2].startswith(_system()):
                    return True
    left = list(folder.glob(f"{glob.escape(stem)}.*"))
    files = [*left, *(inner for path in left for inner in path.rglob("*"))]
    return all(time.time() - path.stat().st_mtime > _SECONDS_TO_WAIT for path in files)


@functools.cache
def _system() -> str:
    """Name the running system, all of whose processes see each other's locks, by its boot or else host: 8 digits."""
    name = socket.gethostname()
    with contextlib.suppress(OSError):
        name = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="utf-8").strip()
    return hashlib.sha256(name.encode()).hexdigest()[:8]
