from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.detect.labels import GROSS, INCIPIENT, NO_SLIP, Onsets, classes_at, read_onsets, seconds, write_onsets
from fingerslip.errors import InputError

TIMES = st.none() | st.floats(0.0, 10.0)


@given(TIMES, TIMES)
def test_classes_follow_the_onsets(incipient: float | None, gross: float | None) -> None:
    time = np.linspace(0.0, 10.0, 41)
    found = classes_at(Onsets(incipient, gross), time)
    assert ((found == GROSS) == (time >= (np.inf if gross is None else gross))).all()
    assert ((found == NO_SLIP) == (time < min(np.inf if one is None else one for one in (incipient, gross)))).all()
    assert set(found[found == INCIPIENT]) <= {INCIPIENT}


@given(st.dictionaries(st.from_regex(r"[a-z][a-z0-9-]{0,8}", fullmatch=True), st.tuples(TIMES, TIMES), max_size=5))
def test_files_give_back_what_was_written(tmp_path_factory: pytest.TempPathFactory, made: dict[str, tuple]) -> None:  # type: ignore[type-arg]
    path = tmp_path_factory.mktemp("onsets") / "onsets.csv"
    onsets = {name: Onsets(*times) for name, times in made.items()}
    write_onsets(onsets, path)
    assert read_onsets(path) == onsets


def test_the_first_onset_is_the_earlier_one() -> None:
    assert Onsets(2.0, 1.0).first == Onsets(None, 1.0).first == 1.0
    assert Onsets(None, None).first is None


def test_gross_slip_alone_may_be_missing_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("\ufefftrial,incipient_s\nt1,0.5\n", encoding="utf-8")
    assert read_onsets(tmp_path / "a.csv") == {"t1": Onsets(0.5, None)}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has the columns none"),
        ("trial,onset\n", "has the columns trial, onset, needs trial, incipient_s, gross_s"),
        ("trial,incipient_s\na,soon\n", r"incipient_s: got 'soon', needs seconds.*line 2"),
        ("trial,incipient_s\na,nan\n", "got 'nan'"),
        ("trial,incipient_s\na,1\na,2\n", "trial 'a' stands twice, needs each trial once .line 3"),
        ("trial,incipient_s\n,1\n", "a row has no trial"),
        ("trial,incipient_s,extra\na,1,2\n", "has the columns"),
        ('trial,incipient_s\n"a,1\n', "is no CSV"),
    ],
)
def test_bad_files_give_one_clear_error(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_onsets(path)


def test_a_file_that_is_missing_or_binary_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_onsets(tmp_path / "none.csv")
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="is no CSV"):
        read_onsets(tmp_path / "b.csv")


def test_a_time_has_to_be_finite() -> None:
    with pytest.raises(InputError, match="onsets: gross: got inf"):
        Onsets(1.0, float("inf"))
    assert seconds("  ", "x") is None
