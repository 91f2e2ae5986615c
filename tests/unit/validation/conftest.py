"""Evidence from synthetic histories, for tests of the validation."""

import dataclasses

import numpy as np
import pytest

from fingerslip.results import RunResult
from fingerslip.slip import SlipEvents, find_events
from fingerslip.validation.evidence import FINGERPRINT, FRICTION, VARIANT, VARIANTS, Evidence
from fingerslip.validation.measures import NODE_TOLERANCES, Measures, measure
from unit import synthetic

UNCERTAINTY = {"slip.overall": 0.01, "overall_peak_height_m_per_s2": 2.0}


def run(swept, uncertainty=None, **process):
    history = synthetic.make(synthetic.Process(**process))  # type: ignore[arg-type]
    return measure(RunResult("run", swept, find_events(history), uncertainty=uncertainty or {}), history)


def in_3d(*incipient):
    """Return a run of the fingertip in 3D whose first reference node leaves the line at these times."""
    readings = dict(zip(NODE_TOLERANCES, (SlipEvents(time, None, None, 1.24) for time in incipient), strict=True))
    measures = run({})
    events = dataclasses.replace(measures.run.events, displacement=readings[NODE_TOLERANCES[1]])
    return Measures(dataclasses.replace(measures.run, events=events), node_tolerances=readings)


@pytest.fixture(scope="module")
def evidence():
    """Return evidence of histories in which slip is overall at 1.71 s, and 10 ms later after a refinement."""
    phalanges = tuple(run({VARIANT: variant}, UNCERTAINTY) for variant in VARIANTS)
    other = tuple(run({VARIANT: variant}, centre=1.72) for variant in VARIANTS)
    same = tuple(run({VARIANT: variant}) for variant in VARIANTS)
    return Evidence(
        {
            "wang2014_table2": phalanges,
            "wang2014_friction": tuple(
                run({FRICTION: mu}, friction=mu, edge=1.0 + 0.5 * mu, centre=1.1 + mu) for mu in (0.2, 0.4, 0.6, 0.8)
            ),
            "wang2014_fingerprint": tuple(
                run({FINGERPRINT: on, VARIANT: variant}) for on in (False, True) for variant in VARIANTS
            ),
            "wang2014_formulation": tuple(
                run({"fingertip.formulation": "plane_strain", VARIANT: variant}) for variant in VARIANTS
            ),
            "wang2014_3d": (in_3d(0.68, 0.79, 0.90),),
            "wang2014_section": tuple(
                run({"fingertip.section": "transverse", VARIANT: variant}) for variant in VARIANTS
            ),
            "finite_strain": tuple(
                run({"kinematics": kinematics, VARIANT: variant}, UNCERTAINTY, centre=centre)
                for kinematics, later in (("small", 0.0), ("finite", 0.2))
                for variant, centre in zip(VARIANTS, np.array([1.71, 1.72, 1.77]) + later, strict=True)
            ),
        },
        (other, same),
        (in_3d(0.70, 0.81, 0.92),),
        (other,),
    )
