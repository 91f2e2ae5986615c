"""States in files: what is written is read, to the last bit, shared where it was shared; nothing else is made."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics.steering.packing import is_like, read_archive, write_archive
from fingerslip.dynamics.system.motion import Motion
from fingerslip.errors import DamagedError


def write_parts(path: Path, parts: dict[str, bytes], compression: int = zipfile.ZIP_STORED) -> None:
    with zipfile.ZipFile(path, "w", compression) as file:
        for name, content in parts.items():
            file.writestr(name, content)


def as_npy(shape: tuple[int, ...], data: bytes) -> bytes:
    memory = io.BytesIO()
    np.lib.format.write_array_header_1_0(memory, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return memory.getvalue() + data


@pytest.mark.parametrize(
    ("parts", "compression"),
    [
        ({"tree.json": b'{"list": [' * 20_000 + b"]}" * 20_000}, zipfile.ZIP_STORED),
        ({"tree.json": b'{"array": "0.npy"}', "0.npy": as_npy((10**14,), b"")}, zipfile.ZIP_STORED),
        ({"tree.json": b'{"array": "0.npy"}', "0.npy": as_npy((2**70,), b"")}, zipfile.ZIP_STORED),
        ({"tree.json": b'{"array": "0.npy"}', "0.npy": as_npy((10**6,), b"\0" * 8 * 10**6)}, zipfile.ZIP_DEFLATED),
        ({"tree.json": b'{"csr": [{"value": 1}, {"value": 1}]}'}, zipfile.ZIP_STORED),
        ({"tree.json": b'{"list": 3}'}, zipfile.ZIP_STORED),
    ],
)
def test_what_is_deep_huge_or_of_another_kind_is_refused(tmp_path: Path, parts, compression: int) -> None:
    write_parts(tmp_path / "made", parts, compression)
    with pytest.raises(DamagedError, match="holds no saved simulation, or is damaged; save the simulation again"):
        read_archive(tmp_path / "made", {})


@pytest.mark.parametrize(
    ("value", "pattern", "is_right"),
    [
        (np.zeros(3), np.ones(3), True),
        (np.zeros(4), np.ones(3), False),
        (np.zeros(3, np.int8), np.ones(3), False),
        ("text", np.ones(3), False),
        (None, np.ones(3), False),
        (np.zeros(3), None, True),
        ("1", 1.0, False),
        ({"a": 1}, {"a": 2.0}, True),
        ({"b": 1}, {"a": 2.0}, False),
        ((1, 2), (1,), False),
        (Motion(np.zeros(2), np.zeros((2, 2))), Motion(np.ones(2), np.ones((2, 2))), True),
        (Motion(np.zeros(2), np.zeros((2, 3))), Motion(np.ones(2), np.ones((2, 2))), False),
    ],
)
def test_types_and_shapes_are_compared(value, pattern, is_right: bool) -> None:
    assert is_like(value, pattern) == is_right


def test_what_is_written_is_read(tmp_path: Path) -> None:
    shared, outside = np.random.default_rng(0).standard_normal((3, 2)), np.eye(2)
    motion = Motion(np.array([0.0, 1.0]), shared)
    value = {
        "motion": motion,
        "plain": [None, True, 3, 0.1, -0.0, float("inf"), "text", (1, (2,))],
        "number": np.float64(0.1) + np.float64(0.2),
        "again": shared,
        "single": np.float32([[1.5]]).T,
        "columns": np.asfortranarray(shared),
        "sparse": sparse.csr_matrix(np.diag([1.0, 0.0, 2.0])),
        "outside": outside,
    }
    write_archive(tmp_path / "file", value, {"known": outside})
    found = read_archive(tmp_path / "file", {"known": outside})
    assert found["plain"] == value["plain"]
    assert found["number"] == value["number"]
    assert isinstance(found["motion"], Motion)
    assert found["motion"].positions is found["again"]
    np.testing.assert_array_equal(found["again"], shared)
    assert found["single"].dtype == np.float32
    assert found["columns"].flags.f_contiguous
    assert found["outside"] is outside
    assert (found["sparse"] != value["sparse"]).nnz == 0


@dataclass(frozen=True)
class Foreign:
    """Not of the package."""

    value: float


def test_only_data_of_the_package_is_written_and_made(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="cannot save a Foreign"):
        write_archive(tmp_path / "file", Foreign(1.0), {})
    assert not (tmp_path / "file").exists()
    for mark in ("os:system", "fingerslip.dynamics.steering.packing:write_packed", "fingerslip.nothing:None"):
        with zipfile.ZipFile(tmp_path / "made", "w") as file:
            file.writestr("tree.json", json.dumps({"of": mark, "fields": {}}))
        with pytest.raises(DamagedError, match="holds no saved simulation, or is damaged"):
            read_archive(tmp_path / "made", {})
