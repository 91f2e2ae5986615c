"""Whole trials: slip or none, beside the length of the clip, and the page of an evaluation."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.detect.evaluation.page import FIGURES, Judged, read_judged, write_evaluation, write_judged
from fingerslip.detect.evaluation.whole import SHIPS, evaluate_whole, slips_of
from fingerslip.detect.labels import Onsets
from fingerslip.detect.page import draw
from fingerslip.detect.session import Choices
from fingerslip.detect.synthetic import SyntheticSensor, SyntheticSlide, synthetic_trial
from fingerslip.detect.trials import TrialSet, write_trials
from fingerslip.errors import DamagedError, InputError
from fingerslip.study.inspection.views import FigureChoice, kinds_text, write_figure
from fingerslip.tables.table import Column, Table

CHOICES = Choices("contact", rest_frames=20, window=5)


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> TrialSet:
    """Return twelve trials, every second one without slip, on two objects each."""
    sensor, cases = SyntheticSensor(metres_per_pixel=120e-6), []
    for number in range(12):
        slide = SyntheticSlide(3e-3, 0.7 * number, 40.0 if number % 2 else 0.8, seed=number, travel=4e-3)
        case = synthetic_trial(f"t{number:02d}", slide, sensor)
        cases.append(type(case)(case.name, case.tracks, case.labels, {"object": str(number // 3)}))
    return write_trials(cases, tmp_path_factory.mktemp("mixed") / "set", "Mixed")


@pytest.mark.slow
def test_slip_is_told_from_none_and_the_length_tells_nothing(mixed, tmp_path):
    (table,) = evaluate_whole(mixed.folder, CHOICES, folds=2, group="object", output=tmp_path)
    accuracies = {str(row[0]): float(str(row[1]).split()[0]) for row in table.rows}
    assert accuracies.pop("length of the clip alone") <= 0.5
    assert accuracies.keys() == {"forest", "logistic", SHIPS}
    assert accuracies["logistic"] > 0.9
    assert accuracies[SHIPS] == 1.0
    assert "12 trials, 6 with slip; to say the commoner always is right in 0.500" in table.note
    assert len(list(tmp_path.glob("*.csv"))) == 1


def test_what_cannot_be_asked_is_refused(mixed):
    with pytest.raises(InputError, match="has no condition 'surface', needs it to be grouped by"):
        evaluate_whole(mixed.folder, CHOICES, group="surface")
    with pytest.raises(InputError, match="has slip in all trials, needs trials with and without"):
        slips_of(mixed, dict.fromkeys(mixed.names, Onsets(1.0, None)))
    with pytest.raises(InputError, match="trial t00: has no label, needs a condition 'slip' or onsets"):
        slips_of(mixed, {})


@pytest.mark.slow
def test_an_evaluation_has_a_page(tmp_path):
    labels = {"a": Onsets(1.0, 2.0), "b": Onsets(None, None)}
    slips, chances = np.array([False, True, True, False]), np.array([0.1, 0.9, 0.6, 0.4])
    late = {"a": Onsets(None, None), "b": Onsets(3.0, None)}
    judged = {
        "forest": Judged(np.diag([2, 1, 1]), chances, slips, {"a": Onsets(1.2, None), "b": Onsets(None, None)}),
        "time_threshold": Judged(np.ones((3, 3), dtype=int), chances, slips, late),
    }
    table = Table("Accuracy", (Column("classifier"),), (("forest",),))
    write_evaluation([table], judged, labels, tmp_path / "page.html", "Evaluation")
    page = (tmp_path / "page.html").read_text()
    for name in ("confusion", "roc", "calibration", "leads", "trials"):
        assert f'id="{name}"' in page
    (tmp_path / "page.html").rename(tmp_path / "evaluation.html")
    with pytest.raises(InputError, match=r"has a page, but no judged.npz: an older version wrote it"):
        kinds_text(tmp_path)
    write_judged(judged, labels, tmp_path)
    read, read_labels = read_judged(tmp_path)
    assert read_labels == labels
    assert [(name, entry.events) for name, entry in read.items()] == [
        (name, entry.events) for name, entry in judged.items()
    ]
    assert read["forest"].matrix.tolist() == judged["forest"].matrix.tolist()
    assert [line.partition(":")[0] for line in kinds_text(tmp_path).splitlines()] == list(FIGURES)
    confusion, trials = (draw(tmp_path, kind) for kind in ("confusion", "trials"))
    assert confusion.axes[1].get_title("left") == "time threshold"
    assert trials.axes[0].get_xlim()[0] < 1.0, "a bar does not begin on the axis"
    for kind in FIGURES:
        assert write_figure(tmp_path, FigureChoice(kind, form="svg")).stat().st_size > 5_000
    with pytest.raises(InputError, match="figure: --run: does not fit --kind roc"):
        write_figure(tmp_path, FigureChoice("roc", run="a"))
    (tmp_path / "judged.npz").write_bytes(b"no archive")
    with pytest.raises(DamagedError, match="run fingerslip detect evaluate again"):
        read_judged(tmp_path)
