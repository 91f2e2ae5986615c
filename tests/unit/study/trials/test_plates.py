"""Plates that move as prescribed or are free to fall."""

from __future__ import annotations

import pytest

import fingerslip as fs
from fingerslip.study.definition.spec import read_study
from fingerslip.study.trials.plates import load_rate, plate_of, programme_of
from places import ROOT


def test_a_plate_without_a_body_moves_as_the_study_says():
    study = read_study(ROOT / "studies" / "bulens2023_dataset.yaml")
    assert plate_of(study) is None
    assert [type(phase) for phase in programme_of(study)] == [fs.Press, fs.Hold, fs.Slide]


def test_a_plate_that_is_a_body_has_a_programme_of_its_own():
    study = read_study(ROOT / "studies" / "bulens2023_pouring_3d.yaml")
    plate = plate_of(study)
    assert plate is not None
    assert plate.free == ("x",)
    assert [type(phase) for phase in programme_of(study)] == [fs.Press, fs.Hold, fs.Hold]
    # Half of 10 g/s.
    assert load_rate(plate) == pytest.approx(0.5 * 0.010 * 9.81, rel=1e-3)


def test_loads_grow_as_fast_as_the_steepest_part_of_their_ramps():
    ramps = fs.Ramp((0.0, 1.0, 3.0), (0.0, 1.0, 0.0)), fs.Ramp((0.0,), (1.0,))
    plate = fs.RigidBody(mass=1.0, free=("x", "z"), loads=tuple(fs.BodyLoad(x=3.0, z=4.0, ramp=ramp) for ramp in ramps))
    assert load_rate(plate) == pytest.approx(5.0)
