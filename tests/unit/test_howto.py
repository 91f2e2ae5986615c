"""The code of README, of how-to pages, tutorials and other pages runs as it is printed; its assertions are the test."""

import numpy as np
import pytest

from fingerslip.contact.states import OPEN
from places import DOCS, ROOT, run_page

PAGES = sorted(path for path in (DOCS / "howto").glob("*.md") if path.name != "index.md")
TUTORIALS = sorted(path for path in (DOCS / "tutorials").glob("*.md") if path.name != "index.md")
# Studies of their own, in other processes; seconds.
LONG = {"results", "clusters", "own-mesh", "afferent-model", "held-object", "grip-controller", "fit"}
SLOW = [page for page in (*PAGES, *TUTORIALS) if page.stem in LONG or page in TUTORIALS]


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=[pytest.mark.slow] * (page in SLOW), id=page.stem) for page in (*PAGES, *TUTORIALS)],
)
def test_page_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "assert " in page.read_text(encoding="utf-8"), "it says what must come out"
    run_page(page)


def test_python_example_finds_overall_slip(capsys):
    names = run_page(ROOT / "README.md")
    # Once all of the contact slides, friction over normal force is the friction coefficient.
    last = names["history"]["counterface_force"].values[-1, 0]
    assert abs(last[0]) == pytest.approx(0.6 * last[1], rel=1e-6)
    # The run of the first row of the page's table.
    assert names["events"].overall == pytest.approx(1.706, abs=5e-4)
    assert "overall slip at" in capsys.readouterr().out


@pytest.mark.slow
def test_example_in_space_slips_and_has_what_the_page_names(capsys):
    names = run_page(DOCS / "solid.md")
    series, events = names["series"], names["events"]
    last = names["history"].isel(time=-1)
    tangential = np.linalg.norm(last["tangential_traction"].values, axis=-1)
    touching = last["contact_state"].values != OPEN
    assert tangential[touching] == pytest.approx(0.6 * last["normal_traction"].values[touching], rel=1e-6)
    # The nodes' frictions are not quite parallel, so their sum stays a little below the limit.
    assert 0.599 < float(series["force_ratio"][-1]) < 0.6
    assert float(series["stick_ratio"][-1]) == 0.0
    assert 0.25 < events.incipient < events.three_quarter < events.overall < 1.0
    assert f"overall slip at {events.overall:.2f} s" in capsys.readouterr().out
    assert names["rates"].dims == names["strains"].dims == ("time", "triangle", "strain_component")
    # The skin in the middle of the contact goes along with the plate until it slips, and not to its end.
    assert 1e-3 < float(names["middle"][-1]) < 6e-3
    assert f"{names['history'].sizes['node']:,} nodes" in (ROOT / "docs" / "solid.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_page_of_your_video_makes_its_clip_and_finds_slip_beside_the_truth(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run_page(DOCS / "slip-in-your-video.md")
    assert (tmp_path / "clips" / "slide.mkv").is_file()
    assert names["onsets"].incipient == pytest.approx(names["slide"].labels["contact"].incipient, abs=0.05)


@pytest.mark.slow
def test_example_of_slip_detection_finds_slip_and_says_that_it_is_no_result(tmp_path, monkeypatch, capsys):
    assert "and are no result" in (ROOT / "docs" / "detection.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert abs(run_page(DOCS / "detection.md")["result"].error.value) < 1.0
    assert "frames a second" in capsys.readouterr().out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["detector", "slides", "submission.csv"]


@pytest.mark.slow
def test_examples_of_cameras_and_tracking_film_follow_and_measure(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run_page(DOCS / "vision.md")
    assert (tmp_path / "slide.mkv").is_file()
    assert names["truth"].sizes["time"] == 61
    assert names["errors"].rms < 0.02
    # Markers that spread by 5 % in both directions.
    assert names["spread"] == pytest.approx(0.1, abs=1e-3)
    assert "61 frames, positions to 0.0" in capsys.readouterr().out
    last = run_page(DOCS / "tracking.md")["displacement"].isel(time=-1)
    assert last.sel(axis="x").values == pytest.approx(np.full(6, 14.0), abs=0.1)
    assert last.sel(axis="y").values == pytest.approx(np.zeros(6), abs=0.1)
