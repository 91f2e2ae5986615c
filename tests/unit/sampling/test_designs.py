"""Designs of samples: where they lie, and what belongs together."""

from typing import get_args

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.results import REPEAT, SAMPLE, Quantity, RunResult
from fingerslip.sampling import designs
from fingerslip.sampling.designs import Method, block_size, draw_shares, output_of
from fingerslip.slip.events import Events, SlipEvents


@pytest.mark.parametrize("method", get_args(Method))
def test_shares_are_in_the_unit_cube_and_follow_from_the_seed(method: str) -> None:
    shares = draw_shares(method, 8, 3, 1)
    assert shares.shape == (8 * block_size(method, 3), 3)
    assert (shares >= 0.0).all()
    assert (shares <= 1.0).all()
    assert np.array_equal(shares, draw_shares(method, 8, 3, 1))
    assert not np.array_equal(shares, draw_shares(method, 8, 3, 2))


def run(**swept: object) -> RunResult:
    return RunResult("run", {path.replace("_", "."): value for path, value in swept.items()}, Events())


def test_quantities_numbers_and_words_become_columns() -> None:
    runs = [
        run(a_depth="1 mm", b=1, word="x", same="3 mm", **{SAMPLE: 1}),
        run(a_depth="3 mm", b=2, word="y", same="3 mm", **{REPEAT: 2}),
    ]
    inputs = designs.inputs_of(runs)
    kinds = [(variable.path, variable.unit, variable.choices) for variable in inputs]
    assert kinds == [("a.depth", "m", ()), ("b", "", ()), ("word", "", ("x", "y"))]
    assert designs.encode(inputs, {"a.depth": "2 mm", "b": 1.5, "word": "y"}) == pytest.approx(
        np.array([0.5, 0.5, 0.0, 1.0])
    )
    with pytest.raises(InputError, match=r"a\.depth: got '2 s', needs 0\.001 to 0\.003 m"):
        inputs[0].columns("2 s")
    assert [inputs[2].at(share) for share in (0.2, 0.7, 1.0)] == ["x", "y", "y"]
    assert inputs[0].columns(inputs[0].at(0.25)) == pytest.approx((0.25,))
    with pytest.raises(InputError, match="has runs that do not differ"):
        designs.inputs_of([run(a=1)])


TRAVEL = Quantity("travel", "m", 2.0)
RUN = RunResult(
    "run", {}, Events(SlipEvents(1.0, overall=1.5)), numbers={"contact_area_max_m2": 3.0}, derived={"travel": TRAVEL}
)


def test_events_measures_and_derived_quantities_have_names() -> None:
    assert output_of(RUN, "latency") == Quantity("latency (accumulated slip)", "s", 0.5)
    assert output_of(RUN, "overall_slip_acceleration") == Quantity("overall slip (acceleration peaks)", "s", None)
    assert output_of(RUN, "contact_area_max") == Quantity("largest contact area", "m^2", 3.0)
    assert output_of(RUN, "penetration_max").value is None
    assert output_of(RUN, "travel") is TRAVEL
    assert all(output_of(RUN, name) is not None for name in designs.output_names(RUN))
    assert output_of(RUN, "latency_x") is None
    with pytest.raises(InputError, match="of: 'latency_x' is not known, needs one of incipient_slip"):
        designs.required_output(RUN, "latency_x")
