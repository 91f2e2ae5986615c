"""The loop over time at large strain."""

from __future__ import annotations

from fingerslip.dynamics.motions import Marched, Motions
from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.stepwise import Stepwise, make_course
from fingerslip.linear.threads import single_dense_thread

__all__ = ["march_finite"]


def march_finite(motions: Motions, number: int) -> Marched:
    """Compute one motion at large strain."""
    watch, model, system = motions.watch, motions.models[number], motions.systems[number]
    with watch.part("assembly"):
        recorder = Recorder(model, system, motions.times[number])
    course = make_course(model, system, motions.solver, watch, recorder.nbytes)[0]
    with watch.part("stepping"), single_dense_thread():
        steps = Stepwise(course, recorder, system, motions.times[number], watch)
        while steps.taken < steps.last:
            steps.step()
            if motions.progress is not None:
                motions.progress(steps.taken / steps.last)
        steps.check()
        with watch.part("recording"):
            recorder.complete()
    return Marched((course.stepper,), (recorder,), course.attributes)
