"""One motion, step by step: what takes the steps follows the kinematics, and checks are made on the way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.finite.course import FiniteCourse
from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.recording.steps import step_times
from fingerslip.dynamics.step.stepper import Stopwatch
from fingerslip.dynamics.stepwise import SmallCourse, Stepwise, make_course
from fingerslip.dynamics.system.system import build_system
from fingerslip.errors import SlipOutsideContactError
from fingerslip.linear.solver import preferred_solver
from fingerslip.verification.meshes import box

MODEL = fs.Model(
    mesh=box("Q4", np.linspace(0.0, 2e-3, 5), np.linspace(0.0, 1e-3, 3)),
    materials={"bulk": fs.NeoHookean(1e5, 0.3, 1000.0)},
    formulation="plane_strain",
    supports={"top": ("x", "y")},
    contacts=(fs.Contact("bottom", fs.Cylinder(1e-3, (0.0, 1.0)), fs.Coulomb(0.3)),),
    programme=(fs.Press(0.2e-3, 1e-3),),
    time=fs.TimeStepping(10e-3),
)


def steps(model: fs.Model) -> Stepwise:
    watch, system, times = Stopwatch(), build_system(model), step_times(model)
    recorder = Recorder(model, system, times)
    course = make_course(model, system, preferred_solver(), watch, recorder.nbytes)
    return Stepwise(course, recorder, system, times, watch)


@pytest.mark.parametrize(("kinematics", "kind"), [("small", SmallCourse), ("finite", FiniteCourse)])
def test_the_course_follows_the_kinematics_and_states_follow_each_other(kinematics: str, kind: type) -> None:
    own = steps(replace(MODEL, kinematics=kinematics))
    assert isinstance(own.course, kind)
    while own.taken < own.last:
        own.step()
        assert own.state.time == pytest.approx(own.taken * 10e-3)
    own.check()
    own.recorder.complete()
    assert own.recorder.values["counterface_force"][-1, 0, 1] > 0.0


def test_nodes_that_are_no_candidates_must_not_touch() -> None:
    contact = replace(MODEL.contacts[0], search_distance=1e-6)
    own = steps(replace(MODEL, contacts=(contact,)))

    def take_all() -> None:
        while own.taken < own.last:
            own.step()
        own.check()

    with pytest.raises(SlipOutsideContactError):
        take_all()
