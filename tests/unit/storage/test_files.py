"""Files and folders that are written whole or not at all, and netCDF."""

import contextlib
import csv
import errno
import hashlib
import io
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from subprocess import PIPE, Popen

import h5py
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import DamagedError, InputError, ResultError
from fingerslip.storage import files
from fingerslip.storage.files import (
    alone,
    check_decimals,
    clean_stale,
    digest,
    new_folder,
    plain_cell,
    read_json,
    write_text,
)
from fingerslip.storage.netcdf import netcdf_bytes, read_netcdf

WRITE = """
import sys
from pathlib import Path
from fingerslip.storage.files import new_file, new_folder
with new_folder(Path(sys.argv[1])) as partial, new_file(Path(sys.argv[1] + ".csv")) as file:
    file.touch()
    (partial / "a").write_text("1")
    input(print())
"""


@contextlib.contextmanager
def writing_process(final: Path) -> Iterator[Popen[bytes]]:
    """Give a process that is writing a folder and a file, and end it as the system does when memory is short."""
    with Popen([sys.executable, "-c", WRITE, str(final)], stdin=PIPE, stdout=PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        yield process
        process.kill()


def left_by_another_machine(folder: Path, days: float) -> Path:
    """Return what another machine began to write so many days ago, whose lock cannot be seen."""
    partial, mark = folder / ".run.0123abcd.partial", folder / ".run.0123abcd.lock"
    partial.mkdir()
    mark.write_text("another boot")
    for path in (partial, mark):
        os.utime(path, (time.time() - 86400.0 * days,) * 2)
    return partial


NAMES = ["=1+1", "+x", "-x", "@SUM(A1)", "\t=1", "'=1", "''=1"]


def test_a_name_that_is_a_formula_is_text_in_tables_and_is_read_back() -> None:
    rows = list(csv.reader(io.StringIO(files.csv_text([[name] for name in NAMES]))))
    assert [row[0] for row in rows] == [f"'{name}" for name in NAMES]
    assert [plain_cell(row[0]) for row in rows] == NAMES
    plain = ["skin", "'skin'", "", "-1.5", "-1e-3", -2.0, None]
    assert next(csv.reader(io.StringIO(files.csv_text([plain])))) == ["skin", "'skin'", "", "-1.5", "-1e-3", "-2.0", ""]
    frame = pd.DataFrame({"=name": NAMES, "value": -0.5})
    read = pd.read_csv(io.StringIO(files.frame_csv(frame)))
    assert list(read.columns) == ["'=name", "value"]
    assert [plain_cell(name) for name in read["'=name"]] == NAMES
    assert (read["value"] == -0.5).all()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('time_s,"force; raw",x\n0.1,1,2\n', None),
        ('a,b\n"a 1,5 b",2\n', None),
        ("a,b\n0,1,2\n", None),
        ("a,b\n1,5,\n", None),
        ("# nothing\n", None),
        ('"time, s";b\n0.1;2\n', "semicolons between its columns, needs"),
        ("a;b\n0,1;2\n", "semicolons between its columns and decimal commas, needs"),
        ('a,b\n"-0,1", 2\n', "decimal commas"),
        ("a,b,c,d\n0,1,1,2,3,5\n", "decimal commas"),
        ("a,b\n" + 5000 * '"0,1",2\n' + "\udcff", "decimal commas"),  # what no reader needs is not read
    ],
)
def test_semicolons_and_decimal_commas_are_told_from_those_in_text(tmp_path: Path, text: str, said: str | None) -> None:
    (tmp_path / "a.csv").write_text(text, encoding="utf-8", errors="surrogateescape")
    with pytest.raises(InputError, match=f"has {said}") if said else contextlib.nullcontext():
        check_decimals(tmp_path / "a.csv")


def test_folder_takes_its_name_when_whole_and_is_replaced_as_a_whole(tmp_path: Path) -> None:
    for name in ("old", "new"):
        with new_folder(tmp_path / "run") as partial:
            (partial / name).write_text("1")
            assert not (tmp_path / "run" / name).exists()
        assert [path.name for path in tmp_path.rglob("*")] == ["run", name]
    for kind in (ValueError, KeyboardInterrupt):
        with pytest.raises(kind), new_folder(tmp_path / "run"):
            raise kind
        assert [path.name for path in tmp_path.rglob("*")] == ["run", "new"], "failure leaves the old folder alone"


def test_what_a_living_process_is_writing_stays_and_what_a_dead_one_left_is_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a container of its own, whose processes have other numbers, its number is nobody's here."""

    def nobody(*_: object) -> None:
        raise ProcessLookupError

    monkeypatch.setattr(os, "kill", nobody)
    with writing_process(tmp_path / "run"):
        clean_stale(tmp_path)
        assert len(list(tmp_path.glob(".run*"))) == 4
    clean_stale(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_what_another_thread_is_writing_stays(tmp_path: Path) -> None:
    with new_folder(tmp_path / "run") as mine:
        clean_stale(tmp_path)
        with new_folder(tmp_path / "run") as other:
            (other / "other").write_text("")
        (mine / "mine").write_text("")
    assert [path.name for path in tmp_path.rglob("*")] == ["run", "mine"]


@pytest.mark.parametrize(("days", "stays"), [(1.0, True), (8.0, False)])
def test_what_another_machine_writes_is_left_for_a_week(tmp_path: Path, days: float, stays: bool) -> None:
    """A network file system may not tell of the locks of others."""
    partial = left_by_another_machine(tmp_path, days)
    clean_stale(tmp_path)
    assert partial.exists() == stays
    assert len(list(tmp_path.iterdir())) == 2 * stays


def test_a_new_folder_clears_what_was_left_under_its_name(tmp_path: Path) -> None:
    with writing_process(tmp_path / "tracks"), writing_process(tmp_path / "other"):
        pass
    with new_folder(tmp_path / "tracks"):
        pass
    assert sorted(path.name[:6] for path in tmp_path.iterdir()) == [".other"] * 4 + [".track"] * 2 + ["tracks"]


@pytest.mark.skipif(shutil.which("unshare") is None, reason="has no process namespaces")
def test_a_container_leaves_what_this_process_is_writing(tmp_path: Path) -> None:
    code = f"from pathlib import Path; from fingerslip.storage.files import clean_stale; clean_stale(Path({str(tmp_path)!r}))"  # noqa: E501
    with new_folder(tmp_path / "run") as partial:
        command = ["unshare", "--user", "--pid", "--fork", "--uts", sys.executable, "-c", code]
        if subprocess.run(command, check=False, capture_output=True).returncode:
            pytest.skip("may make no process namespaces")
        assert partial.is_dir()


def test_run_that_was_moved_away_is_put_back_and_foreign_hidden_files_stay(tmp_path: Path) -> None:
    with writing_process(tmp_path / "run-0.6"):
        (partial,) = tmp_path.glob(".run-0.6.*.partial")
    old = partial.with_suffix(".old")
    old.mkdir()
    (old / "events.json").write_text("{}")
    clean_stale(tmp_path)
    assert [path.name for path in (tmp_path / "run-0.6").iterdir()] == ["events.json"]
    assert not list(tmp_path.glob(".run-0.6.*.partial"))
    foreign = {".gitignore", ".notes.partial", ".x.y.old", ".x.lock"}
    for name in foreign:
        (tmp_path / name).write_text("")
    clean_stale(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"run-0.6", *foreign}


def test_text_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_text(tmp_path / "a.csv", "old")

    def full(self: Path, *arguments: object, **options: object) -> None:
        self.touch()
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(ResultError, match=r"No space left on device.*free some space"):
        write_text(tmp_path / "a.csv", "new")
    assert (tmp_path / "a.csv").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


def test_no_right_to_write_a_folder_and_a_device_in_the_place_of_a_file_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match=r"Permission denied.*give write access"), files.writing(tmp_path):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    (tmp_path / "a.csv").mkdir()
    with pytest.raises(ResultError, match=r"cannot be written \(Is a directory\); remove the folder of that name"):
        write_text(tmp_path / "a.csv", "")
    if Path("/dev/full").exists():
        with pytest.raises(ResultError, match="/dev/full: is a device; needs the name of a file"):
            write_text(Path("/dev/full"), "x")
        assert Path("/dev/full").is_char_device()


def test_json_comes_back_as_it_was_written(tmp_path: Path) -> None:
    values = {"b": [1, 2.5, None, {"é": float("inf")}], "a": "x"}
    files.write_json(tmp_path / "a.json", values)
    assert list(read_json(tmp_path / "a.json", "").items()) == list(values.items())
    with pytest.raises(FileNotFoundError):
        read_json(tmp_path / "none.json", "")


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (b"", "is damaged: it is no JSON"),
        (b"\xff\xfe", "is damaged: it is no JSON"),
        (b"[" * 100_000, "is damaged: it is no JSON"),
        (b"9" * 5000, "is damaged: it is no JSON"),
        (b"[]", "has no checksum: it is damaged or of an earlier version"),
        (b'{"a": 1}', "has no checksum: it is damaged or of an earlier version"),
        (b'{"a": 1, "checksum": "0"}', "is damaged: its checksum is another"),
        (None, r"cannot be read \(Is a directory\)"),
    ],
)
def test_damaged_json_is_named_with_what_to_do(tmp_path: Path, content: bytes | None, found: str) -> None:
    path = tmp_path / "a.json"
    path.mkdir() if content is None else path.write_bytes(content)
    with pytest.raises(DamagedError, match=rf"a\.json: {found}; run it again"):
        read_json(path, "run it again")


def test_a_folder_of_something_else_and_a_file_are_not_to_be_replaced(tmp_path: Path) -> None:
    files.check_replaceable(tmp_path / "new", "mark")
    files.check_replaceable(tmp_path, "mark")
    files.check_empty(tmp_path)
    (tmp_path / "other").write_text("")
    with pytest.raises(InputError, match="holds files, but no mark, needs a new folder"):
        files.check_replaceable(tmp_path, "mark")
    with pytest.raises(InputError, match="is a file, needs a folder"):
        files.check_replaceable(tmp_path / "other", "mark")
    (tmp_path / "mark").write_text("")
    files.check_replaceable(tmp_path, "mark")
    files.check_empty(tmp_path / "new")
    with pytest.raises(InputError, match="holds files, needs a new or an empty folder; give another name"):
        files.check_empty(tmp_path)
    with pytest.raises(InputError, match="is a file, needs a folder"):
        files.check_empty(tmp_path / "other")


def test_processes_are_let_in_one_by_one(tmp_path: Path) -> None:
    """The lock of a process that is killed goes with it."""
    mark = tmp_path / "made" / ".mark"
    code = f"from pathlib import Path; from fingerslip.storage.files import alone\nwith alone(Path({str(mark)!r})): input(print())"  # noqa: E501
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        other.stdout.readline()
        assert mark.exists()
        other.kill()
        other.wait()
        with alone(mark):
            assert mark.exists()
    assert not mark.parent.exists()


ROUNDS, PROCESSES = 200, 4
ENTER = """
import os, sys
from pathlib import Path
from fingerslip.storage.files import alone
mark, inside = Path(sys.argv[1]), sys.argv[2]
for _ in range(int(sys.argv[3])):
    with alone(mark):
        os.close(os.open(inside, os.O_CREAT | os.O_EXCL))
        os.unlink(inside)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="has no such lock")
def test_never_two_processes_are_inside(tmp_path: Path) -> None:
    """The one that leaves takes file and folder away, while others wait and come."""
    command = [sys.executable, "-c", ENTER, str(tmp_path / "made" / ".mark"), str(tmp_path / "inside"), str(ROUNDS)]
    others = [subprocess.Popen(command, stderr=subprocess.PIPE, text=True) for _ in range(PROCESSES)]
    assert [other.communicate()[1] for other in others] == [""] * PROCESSES
    assert list(tmp_path.iterdir()) == []


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)


@given(PLAIN, PLAIN)
def test_equal_data_and_only_equal_data_have_equal_hashes(one: object, other: object) -> None:
    same = repr(one) == repr(other)
    assert (digest(one) == digest(other)) == same or one == other


def test_arrays_are_hashed_by_their_values_in_rows_and_files_by_their_content(tmp_path: Path) -> None:
    values = np.arange(6.0).reshape(2, 3)
    assert digest(values) == digest(np.asfortranarray(values)) == hashlib.sha256(values.tobytes()).hexdigest()
    assert digest(values) != digest(values + 1e-15)
    (tmp_path / "a").write_bytes(b"some")
    assert files.file_digest(tmp_path / "a") == digest(b"some") == hashlib.sha256(b"some").hexdigest()


def test_what_is_made_of_the_current_folder_stands_beside_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "frames").mkdir()
    monkeypatch.chdir(tmp_path / "frames")
    assert files.folder_beside(Path(), "tracks", lambda _: "") == tmp_path / "frames_tracks"


def dataset(count: int = 3) -> xr.Dataset:
    """Return numbers of all kinds, text, and a dimension without a variable."""
    values = {
        "force": (("time", "place", "axis"), np.arange(2.0 * count * 2).reshape(2, count, 2), {"units": "N"}),
        "state": (("time", "place"), np.ones((2, count), dtype=np.int8)),
        "steps": (("time",), np.arange(2, dtype=np.int32)),
        "lost": (("time",), np.array([np.nan, 1.0], dtype=np.float32)),
        "total": ((), 3.5),
    }
    coordinates = {
        "time": ("time", [0.0, 0.5], {"units": "s", "long_name": "time"}),
        "place": ("place", np.array([f"ä{number}" for number in range(count)], dtype="U4")),
        "kind": ("place", np.array([""] * count, dtype="U1")),
    }
    return xr.Dataset(values, coords=coordinates, attrs={"title": "härte", "n": 3, "share": 0.25, "names": ["a", "b"]})


def read(content: bytes) -> xr.Dataset:
    return xr.open_dataset(io.BytesIO(content), engine="h5netcdf", decode_timedelta=False).load()


def test_chosen_variables_are_compressed_and_dimensions_have_scales() -> None:
    with h5py.File(io.BytesIO(netcdf_bytes(dataset(), ["force"]))) as file:
        assert (file["force"].compression, file["state"].compression) == ("gzip", None)
        assert [own[0].name for own in file["force"].dims] == ["/time", "/place", "/axis"]
        assert file["axis"].attrs["NAME"].startswith(b"This is a netCDF dimension but not a netCDF variable")
        assert file["axis"].shape == (2,)
        assert sorted(int(file[name].attrs["_Netcdf4Dimid"]) for name in ("time", "place", "axis")) == [0, 1, 2]


@pytest.mark.parametrize("count", [3, 0])
def test_files_are_what_a_general_writer_writes_and_are_read_as_a_general_reader_does(
    tmp_path: Path, count: int
) -> None:
    given = dataset(count)
    ours, theirs = netcdf_bytes(given, ["force", "total"]), bytes(given.to_netcdf(engine="h5netcdf"))
    expected = read(theirs)
    for content in (ours, theirs):
        (tmp_path / "given.nc").write_bytes(content)
        for found in (read(content), read_netcdf(tmp_path / "given.nc")):
            xr.testing.assert_identical(found, expected)
            kinds = [(name, variable.dtype) for name, variable in found.variables.items()]
            assert kinds == [(name, variable.dtype) for name, variable in expected.variables.items()]
            assert [*map(type, found.attrs.values())] == [*map(type, read(content).attrs.values())]
    (tmp_path / "given.nc").write_bytes(ours)
    once = read_netcdf(tmp_path / "given.nc")
    (tmp_path / "again.nc").write_bytes(netcdf_bytes(once))
    xr.testing.assert_identical(read_netcdf(tmp_path / "again.nc"), once)
