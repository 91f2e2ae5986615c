"""Print, as JSON, what users read from small runs: events and forces. Other processors must print the same."""

import json
import sys

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import box
from problems.pushed import push_and_slide, section


def models():
    """Return the runs by name: a fingertip's section, 3D, large strain, viscoelastic, quasi-static, adaptive steps."""
    neo_hookean = {"bulk": fs.NeoHookean(34e3, 0.4, 1000.0)}
    relaxing = {"bulk": fs.Elastic(34e3, 0.4, 1000.0, prony=(fs.PronyTerm(0.3, 0.05),))}
    solid = {
        "mesh": box("H8", np.linspace(-4e-3, 4e-3, 9), np.linspace(0.0, 4e-3, 5), np.linspace(0.0, 4e-3, 5)),
        "formulation": "solid",
        "depth": 1.0,
        "supports": {"top": ("x", "y", "z")},
        "contacts": (fs.Contact("bottom", fs.Plane(normal=(0, 0, 1)), fs.Coulomb(0.3)),),
        "programme": (fs.Press(0.3e-3, 6e-3), fs.Slide(0.6e-3, 12e-3, direction=(1.0, 0.0, 0.0))),
    }
    return {
        "fingertip": section(sizes=(0.15e-3, 0.5e-3), travel=6e-3, time=fs.TimeStepping(10e-3, -0.41421)),
        "solid": push_and_slide(**solid),
        "large strain": push_and_slide("T6", kinematics="finite", materials=neo_hookean),
        "viscoelastic": push_and_slide(materials=relaxing),
        "quasi-static": push_and_slide(time=fs.QuasiStatic(5e-3)),
        "adaptive": push_and_slide(time=fs.Adaptive(output=5e-3)),
    }


def main() -> None:
    outcomes = {}
    for name, model in models().items():
        history = fs.simulate(model)
        events = fs.find_events(history)
        times = [events.incipient, events.three_quarter, events.overall]
        outcomes[name] = {"force": history["counterface_force"].values.tolist(), "events": times}
    sys.stdout.write(json.dumps(outcomes))


if __name__ == "__main__":
    main()
