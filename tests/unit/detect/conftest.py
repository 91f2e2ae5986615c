"""A small data set of analytic trials, made once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fingerslip.detect.features import FeatureSettings, MotionSettings
from fingerslip.detect.samples import Samples, Sampling, samples_of
from fingerslip.detect.synthetic import synthetic_slides
from fingerslip.detect.training import Detector, train
from fingerslip.detect.trials import TrialSet, open_trials, write_trials

MOTION = MotionSettings(rest_frames=20, window=5)
SAMPLING = Sampling(20, 6, 6, 20, least=0.5)


@pytest.fixture(scope="session")
def trials_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of 24 trials; tests leave it as it is."""
    folder = tmp_path_factory.mktemp("trials") / "slides"
    write_trials(
        synthetic_slides((3e-3, 4e-3), directions=4, repeats=3, seed=1, travel=8e-3), folder, "Analytic slides"
    )
    return folder


@pytest.fixture(scope="session")
def trials(trials_folder: Path) -> TrialSet:
    return open_trials(trials_folder)


@pytest.fixture(scope="session")
def samples(trials: TrialSet) -> Samples:
    settings = FeatureSettings(("displacement", "speed", "mean", "time", "rings"), MOTION)
    return samples_of(trials, trials.onsets(), settings, SAMPLING)


@pytest.fixture(scope="session")
def detector(trials: TrialSet) -> Detector:
    """Return a detector that learned from eight trials."""
    return train(trials, trials.onsets(), "logistic", motion=MOTION, sampling=SAMPLING, names=trials.names[:8])


@pytest.fixture
def copied(trials_folder: Path, tmp_path: Path) -> Callable[[], Path]:
    """Return a function that copies the data set to where a test may change it."""
    import shutil

    return lambda: Path(shutil.copytree(trials_folder, tmp_path / "copy"))
