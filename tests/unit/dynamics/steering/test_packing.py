"""States in files: what is written is read, to the last bit, shared where it was shared; nothing else is made."""

from __future__ import annotations

import json
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics.steering.packing import read_packed, write_packed
from fingerslip.dynamics.system.motion import Motion
from fingerslip.errors import DamagedError


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
    write_packed(tmp_path / "file", value, {"known": outside})
    found = read_packed(tmp_path / "file", {"known": outside})
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
        write_packed(tmp_path / "file", Foreign(1.0), {})
    assert not (tmp_path / "file").exists()
    for mark in ("os:system", "fingerslip.dynamics.steering.packing:write_packed", "fingerslip.nothing:None"):
        with zipfile.ZipFile(tmp_path / "made", "w") as file:
            file.writestr("tree.json", json.dumps({"of": mark, "fields": {}}))
        with pytest.raises(DamagedError, match="holds no saved simulation, or is damaged"):
            read_packed(tmp_path / "made", {})
