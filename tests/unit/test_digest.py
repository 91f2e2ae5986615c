"""Hashes differ where their inputs do, and only there."""

from __future__ import annotations

import doctest
import hashlib
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import fingerslip.storage.files
from fingerslip.storage.files import digest, file_digest

PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)


@given(PLAIN, PLAIN)
def test_equal_data_and_only_equal_data_have_equal_hashes(one: object, other: object) -> None:
    same = repr(one) == repr(other)
    assert (digest(one) == digest(other)) == same or one == other


def test_arrays_are_hashed_by_their_values_in_rows() -> None:
    values = np.arange(6.0).reshape(2, 3)
    assert digest(values) == digest(np.asfortranarray(values)) == hashlib.sha256(values.tobytes()).hexdigest()
    assert digest(values) != digest(values + 1e-15)


def test_files_are_hashed_by_their_content(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"some")
    assert file_digest(tmp_path / "a") == digest(b"some") == hashlib.sha256(b"some").hexdigest()


def test_the_example_in_the_docstring() -> None:
    assert doctest.testmod(fingerslip.storage.files).failed == 0
