from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.detect.classifiers import CLASSIFIERS
from fingerslip.detect.evaluation.inquiries import importance_by_ring, learning_curve
from fingerslip.detect.samples import Samples
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import InputError


def test_a_learning_curve_has_a_point_for_each_size(samples: Samples, trials: TrialSet) -> None:
    points = learning_curve(samples, CLASSIFIERS["time_threshold"], trials.names[:4], (4, 20))
    assert [one.trials for one in points] == [4, 20]
    for estimate in (one for point in points for one in (point.accuracy, point.f1)):
        assert 0.3 < estimate.value <= 1.0
        assert 0.0 <= estimate.low < estimate.high <= 1.0
        assert estimate.low <= estimate.value <= estimate.high
    with pytest.raises(InputError, match="sizes: got 21, needs 1 to 20"):
        learning_curve(samples, CLASSIFIERS["time_threshold"], trials.names[:4], (21,))


def test_the_ring_that_tells_is_the_one_that_counts(samples: Samples, trials: TrialSet) -> None:
    draw = np.random.default_rng(0)
    inner = np.array(
        [int(name.split("/")[-1]) in (1, 2, 3) if name.count("/") == 2 else False for name in samples.names]
    )
    values = np.where(inner, samples.classes[:, None], 0) + 0.1 * draw.normal(size=samples.values.shape)
    made = dataclasses.replace(samples, values=values.astype(np.float32))
    drops = importance_by_ring(made, CLASSIFIERS["logistic"], trials.names[:4])
    assert list(drops) == [0, 1, 2, 3, 4]
    assert drops[1].value > drops[1].low > 0.3
    assert max(abs(drop.value) for ring, drop in drops.items() if ring != 1) < 0.05


def test_classifiers_without_markers_have_no_rings(samples: Samples, trials: TrialSet) -> None:
    with pytest.raises(InputError, match="classifier time_threshold: sees no single markers"):
        importance_by_ring(samples, CLASSIFIERS["time_threshold"], trials.names[:4])
