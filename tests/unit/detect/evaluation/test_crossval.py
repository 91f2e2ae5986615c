"""Folds of trials, and an evaluation that goes on where it was interrupted."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from fingerslip.detect.classifiers import CLASSIFIERS
from fingerslip.detect.evaluation.crossval import Evaluation, Parts, begin_evaluation, parts_beside
from fingerslip.detect.labels import Onsets
from fingerslip.detect.samples import Samples, grouped_folds
from fingerslip.errors import InputError
from unit.detect.conftest import MOTION, SAMPLING

CANDIDATES = [CLASSIFIERS[name] for name in ("time_threshold", "displacement_threshold")]
Begin = Callable[..., Evaluation]
ARRAYS = {"rows": np.arange(5), "chances": np.linspace(0.0, 1.0, 6).reshape(2, 3)}


def test_no_trial_is_on_both_sides_and_events_are_found_in_all(samples, trials):
    onsets = trials.onsets()
    run = Evaluation(trials, onsets, samples, MOTION, share=0.25)
    folds = [run.fit(CLASSIFIERS["logistic"], test) for test in grouped_folds(trials.names, 3, 0)]
    for fold in folds:
        assert len(fold.calibration) == 3
        assert not set(fold.calibration) & set(fold.tested)
    matrices = run.matrices([fold.frames for fold in folds])
    assert len(matrices) == 24
    assert matrices.sum() == len(samples.classes)
    events = [pair for event in run.events(folds) for pair in event.items()]
    assert {name for name, _ in events} == set(trials.names)
    # The calibration trials allow a quarter of the trials an alarm before slip; twelve of 24 would be far beyond that.
    early = sum(event.first is not None and event.first < (onsets[name].first or 0.0) for name, event in events)
    assert early < 12


@pytest.mark.slow
def test_frames_of_known_trials_are_easier_for_a_classifier_that_learns_them_by_heart(trials):
    """Trials whose frames differ by an offset of the trial alone leak through a split by sample."""
    draw = np.random.default_rng(0)
    classes = np.tile(np.repeat([0, 1, 2], 20), 20).astype(np.int8)
    trial = np.repeat(np.arange(20), 60)
    key = draw.normal(size=(20, 3, 4))
    values = (key[trial, classes] + 0.05 * draw.normal(size=(1200, 4))).astype(np.float32)
    names = tuple(f"{name}/x/{number}" for name in ("displacement", "speed") for number in (0, 1))
    known = tuple(f"t{number}" for number in range(20))
    samples = Samples(values, classes, trial, 0.0 * trial, names, known, np.zeros(2, dtype=np.intp), *np.zeros((2, 20)))
    run, forest = Evaluation(trials, dict.fromkeys(known, Onsets(1.0, 2.0)), samples, MOTION), CLASSIFIERS["forest"]
    grouped = run.matrices([run.fit(forest, test).frames for test in grouped_folds(known, 5, 0)])
    accuracy = [np.trace(matrices.sum(axis=0)) / matrices.sum() for matrices in (grouped, run.by_sample(forest))]
    assert accuracy[0] < 0.5
    assert accuracy[1] > 0.95


def test_folds_that_leave_nothing_to_learn_from_and_a_file_for_a_folder_are_refused(begin, trials, tmp_path):
    run = begin()
    with pytest.raises(InputError, match="folds: leave no trial to learn from"):
        run.rows_to_learn(trials.names)
    classes = np.where(run.samples.trial > 0, np.minimum(run.samples.classes, 1), run.samples.classes)
    few = dataclasses.replace(run.samples, classes=classes)
    with pytest.raises(InputError, match="leaves out trial slide-0000: has no frame of gross to learn from"):
        dataclasses.replace(run, samples=few).rows_to_learn(trials.names[:1])
    (tmp_path / "tables").write_text("mine")
    with pytest.raises(InputError, match="is a file, needs a folder"):
        parts_beside(tmp_path / "tables")


@pytest.fixture
def begin(trials, samples):
    """Return a function that begins an evaluation, with parts beside an output."""
    some, onsets = dataclasses.replace(trials, names=trials.names[::2]), trials.onsets()
    return lambda output=None: Evaluation(some, onsets, samples, MOTION, parts=parts_beside(output, "data"))


@pytest.fixture
def fits(monkeypatch):
    """Return a list that gets the name of the classifier of every fit; the third fit is interrupted."""
    names = []

    def counted(run, candidate, test, *, fit=Evaluation.fit):
        names.append(candidate.name)
        if len(names) == 3:
            raise KeyboardInterrupt
        return fit(run, candidate, test)

    monkeypatch.setattr(Evaluation, "fit", counted)
    return names


@pytest.mark.slow
def test_an_interrupted_evaluation_goes_on(begin, tmp_path, fits):
    names = begin().trials.names
    tests = grouped_folds(names, 3, 0)
    with pytest.raises(KeyboardInterrupt):
        begin(tmp_path / "tables").by_fold(CANDIDATES, tests)
    assert len(list((tmp_path / "tables.unfinished").iterdir())) == 2  # both classifiers of the first fold
    run = begin(tmp_path / "tables")
    frames, events = run.by_fold(CANDIDATES, tests)
    assert len(fits) == 3 + 4  # the first fold is not fitted again
    whole_frames, whole_events = begin().by_fold(CANDIDATES, tests)
    assert events == whole_events
    assert all(list(onsets) == list(names) for onsets in events.values())
    for name, pieces in whole_frames.items():
        assert np.array_equal(run.matrices(frames[name]), run.matrices(pieces))
    groups = run.by_group(CANDIDATES[0], tests[:1])
    count = len(fits)
    assert np.array_equal(run.by_group(CANDIDATES[0], tests[:1])[0].chances, groups[0].chances)
    first, second = (begin(tmp_path / "tables").by_sample(CANDIDATES[0]) for _ in range(2))
    assert np.array_equal(first, second)
    assert len(fits) == count


@pytest.mark.slow
def test_other_labels_are_not_taken_for_the_same(trials, tmp_path):
    later = {name: Onsets(one.incipient, (one.gross or 0.0) + 0.05) for name, one in trials.onsets().items()}
    output = tmp_path / "tables"
    first, second, third = (
        begin_evaluation(trials, onsets, CANDIDATES[:1], MOTION, SAMPLING, output=output).parts.inputs
        for onsets in (trials.onsets(), trials.onsets(), later)
    )
    assert first == second != third


@pytest.mark.parametrize("folder", ["tables", None])
def test_a_part_is_made_once_where_there_is_a_folder_and_other_inputs_are_another(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    calls = []
    store = parts_beside(tmp_path / folder if folder else None, "data")
    for _ in range(2):
        arrays = store.part("forest:mean", [1, "a"], lambda: calls.append(1) or ARRAYS)
        assert arrays.keys() == ARRAYS.keys()
        assert all(np.array_equal(arrays[name], ARRAYS[name]) for name in ARRAYS)
    assert len(calls) == (1 if folder else 2)
    assert store.folder == (tmp_path / "tables.unfinished" if folder else None)
    store.remove()
    assert list(tmp_path.iterdir()) == []
    parts_beside(tmp_path / "tables", "data").write("forest", [1], ARRAYS)
    for key in (("data", "forest", 1), ("other", "forest", 1), ("data", "logistic", 1), ("data", "forest", 2)):
        stored = parts_beside(tmp_path / "tables", key[0]).read(key[1], [key[2]])
        assert (stored is not None) == (key == ("data", "forest", 1)), key


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(b"no arrays"),
        lambda path: path.write_bytes(path.read_bytes().replace(np.arange(5).tobytes(), np.arange(1, 6).tobytes())),
        lambda path: np.savez(path, rows=np.array([print], dtype=object)),
    ],
    ids=["cut", "empty", "foreign", "changed", "what would run"],
)
def test_a_damaged_part_is_made_again(tmp_path, damage):
    store = Parts(tmp_path, "data")
    store.write("forest", [1], ARRAYS)
    damage(next(tmp_path.iterdir()))
    assert store.read("forest", [1]) is None
