"""Refinement of the fingertip of the shipped two-dimensional study in mesh, time step and contact stiffness."""

import dataclasses

import fingerslip as fs
from fingerslip.dynamics.system.checks import contact_penalties
from fingerslip.uncertainty import ORDERS, Series, refine
from fingerslip.verification.problem import Problem, VerificationError, absolute, solve_problem

_SIZES = (0.12e-3, 0.28e-3)
_MESHES = (1.0, 2.0 / 3.0, 0.5)
_STEPS = (1.0, 0.5, 0.25)
_COMPLIANCES = (1.0, 0.25, 0.0625)
# All published slip times are printed to two decimals [s].
_RESOLUTION = 0.010


def _model(mesh_factor=1.0, step_factor=1.0):
    finger = fs.preset("wang2014-2d")
    return fs.Model(
        mesh=fs.build_section(finger, contact_size=mesh_factor * _SIZES[0], bulk_size=mesh_factor * _SIZES[1]),
        materials=finger.materials,
        formulation=finger.formulation,
        depth=finger.depth,
        supports={"phalanx": ("x", "y")},
        contacts=(fs.Contact("skin", fs.Plane(normal=(0.0, 1.0)), fs.Coulomb(0.6)),),
        programme=(fs.Press(1.5e-3, 1.5e-3), fs.Slide(distance=3e-3, speed=3e-3, direction=(-1.0, 0.0))),
        time=fs.TimeStepping(5e-3 * step_factor, -0.41421),
    )


def _softer(model, compliance):
    (contact,) = model.contacts
    normal, tangential = contact_penalties(model, contact)
    stiff = dataclasses.replace(contact, normal_penalty=normal / compliance, tangential_penalty=tangential / compliance)
    return dataclasses.replace(model, contacts=(stiff,))


def _refinement():
    """Hold the uncertainty of the slip times against the resolution of the published ones, and show an order.

    The penalties act in first order; overall slip as read from displacement shows it, because it is not rounded to
    steps. That a node lets go between two contact nodes or two records leaves no clean order with mesh and step.
    """
    base = _model()
    events = {
        "mesh": [fs.find_events(solve_problem(_model(mesh_factor=factor))) for factor in _MESHES],
        "step": [fs.find_events(solve_problem(_model(step_factor=factor))) for factor in _STEPS],
        "penalty": [fs.find_events(solve_problem(_softer(base, factor))) for factor in _COMPLIANCES],
    }
    times = (("three-quarter", lambda found: found.slip.three_quarter), ("overall", lambda found: found.slip.overall))
    for setting, runs in events.items():
        for name, read in times:
            error = _refined(setting, runs, read).uncertainty
            if error is None:
                raise VerificationError("a slip event did not happen at every level of refinement")
            yield absolute(f"{name} slip: uncertainty over the {setting} [s]", 0.0, error, _RESOLUTION)
    order = _refined("penalty", events["penalty"], lambda found: found.displacement.overall).order
    yield absolute("overall slip: observed order in the contact compliance", 1.0, order or 0.0, 0.2)


def _refined(setting, runs, read):
    sizes = {"mesh": _MESHES, "step": _STEPS, "penalty": _COMPLIANCES}[setting]
    return refine(Series(setting, sizes, tuple(map(read, runs))), ORDERS[setting])


_TITLE = "Slip times of the fingertip of Table 2, refined in mesh, step and contact stiffness"
_SOURCE = "Richardson's extrapolation, grid convergence index"
PROBLEMS = (Problem("fingertip-refinement", _TITLE, _SOURCE, _refinement, slow=True),)
