"""Results of runs and sensitivities that tests of tables share."""

from fingerslip.published import published_set
from fingerslip.results import RunResult
from fingerslip.sampling.indices import Index, Sensitivity
from fingerslip.slip import Events, SlipEvents
from fingerslip.slip.front import EdgeContact

FULL = SlipEvents(incipient=1.5, noticed=1.6, three_quarter=1.65, overall=1.75)
EVENTS = Events(slip=FULL, displacement=SlipEvents(incipient=1.45), acceleration=SlipEvents(overall=1.71))
UNRECORDED = Events(slip=FULL, acceleration=SlipEvents(recorded=False))
PLAIN = {**published_set("wang2014-table2").values[0].programme, "fingertip.fingerprint.enabled": False}
RUNS = tuple(
    RunResult(
        f"friction_coefficient-{friction}",
        {"contact.friction_coefficient": friction, "fingertip.phalanx.variant": "original"},
        events,
        values=PLAIN,
    )
    for friction, events in ((0.6, EVENTS), (0.8, Events()))
)
CUT_OFF = RunResult("angle-30deg", {"fingertip.solid.angle": "30 deg"}, EVENTS, edge=EdgeContact("skin", 0.12, 0.3e-3))
INDICES = (
    Index("contact.friction_coefficient", 0.6, 0.1, 0.5, 0.2, 0.1),
    Index("programme.0.press.depth", 0.3, 0.1, 0.2),
)


def sensitivity(method, **more):
    values = {"group": {}, "mean": 0.4, "deviation": 0.1, "runs": 56, "blocks": 8, "left_out": 1, **more}
    return Sensitivity(method, "latency", "latency (accumulated slip)", "s", indices=INDICES, **values)  # type: ignore[arg-type]
