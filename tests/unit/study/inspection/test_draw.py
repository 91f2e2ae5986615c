"""fingerslip show --figure: the picture of a preset or a study."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.errors import InputError
from fingerslip.study.inspection.draw import draw_specimen


def test_preset_and_study_are_drawn(tmp_path: Path) -> None:
    study = tmp_path / "study.yaml"
    study.write_text("fingertip: {preset: wang2014-2d}\ntime: {step: 5 ms, end: 10 ms}\n", encoding="utf-8")
    for number, target in enumerate(("wang2014-3d", "tactip-ridged-3d", str(study))):
        picture = tmp_path / "new" / f"{number}.png"
        draw_specimen(target, picture)
        assert picture.read_bytes().startswith(b"\x89PNG")


def test_what_cannot_be_drawn_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"needs a file that ends in \.png, \.svg, \.pdf"):
        draw_specimen("wang2014-3d", tmp_path / "finger.doc")
    with pytest.raises(InputError, match="preset: 'nobody' is not known"):
        draw_specimen("nobody", tmp_path / "finger.png")
