"""The fingertip of the shipped 2D study: refined in mesh, time step and contact stiffness, and in a reduced basis."""

import dataclasses

import numpy as np

import fingerslip as fs
from fingerslip.dynamics.system.checks import contact_penalties
from fingerslip.uncertainty import ORDERS, Series, refine
from fingerslip.verification.problem import Problem, VerificationError, absolute, solve_problem
from problems.pushed import section

# Factors of cells, steps and the compliance of the contact.
_LEVELS = {"mesh": (1.0, 2.0 / 3.0, 0.5), "step": (1.0, 0.5, 0.25), "penalty": (1.0, 0.25, 0.0625)}
# All published slip times are printed to two decimals [s].
_RESOLUTION = 0.010


def _refined(setting, factor):
    """Return the model with one setting changed by a factor."""
    mesh, step = (factor if setting == name else 1.0 for name in ("mesh", "step"))
    model = section(sizes=(mesh * 0.12e-3, mesh * 0.28e-3), time=fs.TimeStepping(step * 5e-3, -0.41421))
    if setting != "penalty":
        return model
    (contact,) = model.contacts
    normal, tangential = contact_penalties(model, contact)
    stiff = dataclasses.replace(contact, normal_penalty=normal / factor, tangential_penalty=tangential / factor)
    return dataclasses.replace(model, contacts=(stiff,))


def _refinement():
    """Hold the uncertainty of the slip times against the resolution of the published ones, and show an order.

    The penalties act in first order; overall slip as read from displacement shows it, because it is not rounded to
    steps. That a node lets go between two contact nodes or two records leaves no clean order with mesh and step.
    """

    def refined(setting, read):
        return refine(Series(setting, _LEVELS[setting], tuple(map(read, events[setting]))), ORDERS[setting])

    times = {"three-quarter": lambda run: run.slip.three_quarter, "overall": lambda run: run.slip.overall}
    events = {}
    for setting, factors in _LEVELS.items():
        events[setting] = [fs.find_events(solve_problem(_refined(setting, factor))) for factor in factors]
        for name, read in times.items():
            error = refined(setting, read).uncertainty
            if error is None:
                raise VerificationError("a slip event did not happen at every level of refinement")
            yield absolute(f"{name} slip: uncertainty over the {setting} [s]", 0.0, error, _RESOLUTION)
    order = refined("penalty", lambda run: run.displacement.overall).order
    yield absolute("overall slip: observed order in the contact compliance", 1.0, order or 0.0, 0.2)


_LOOSE, _TIGHT = fs.ReducedBasis(1e-4, 5e-3), fs.ReducedBasis(1e-5, 1e-3)
_WEIGHT = (0.0, -9.81)
# Numerical damping of the shipped studies, and the default one; a weight that acts at once is not in the basis.
_CASES = {
    f"alpha {alpha:g}{', weight' if gravity else ''}, tolerance {basis.tolerance:g}": (alpha, gravity, basis)
    for alpha, gravity, basis in ((-0.41421, None, _TIGHT), (-0.41421, _WEIGHT, _TIGHT), (-0.05, None, _LOOSE))
}
_MOTIONS = {
    "contact displacement": "contact_displacement",
    "displacement at sites": "displacement",
    "slip distance": "slip_distance",
    "traction": "tangential_traction",
    "strain energy density at sites": "strain_energy_density",
}
_ACCELERATIONS = {"acceleration of the contact": "contact_acceleration", "acceleration of sites": "acceleration"}


def _solved_both(time, gravity, basis):
    """Return the histories of the fingertip on a coarse mesh, and in a reduced basis."""
    sites = tuple(fs.Site(f"below {x:g} mm", "", (1e-3 * x, -5e-3), None) for x in (-8, -5, -2))
    full = section(towards=1.0, time=time, gravity=gravity, record=fs.Recording(sites))
    reduced = solve_problem(dataclasses.replace(full, basis=basis))
    if reduced.attrs["basis"] != "reduced":
        raise VerificationError("the motion was not computed in a reduced basis")
    return solve_problem(full), reduced


def _difference(words, histories, name, allowed):
    """Return the check of the root of the mean square of a difference over that of the variable."""
    full, reduced = (history[name].values for history in histories)
    error = float(np.linalg.norm(reduced - full) / np.linalg.norm(full))
    return absolute(f"{words}, rms error / rms", 0.0, error, allowed)


def _dynamic(alpha, gravity, basis):
    """Hold the errors of a motion in a reduced basis against the tolerances that it was given."""
    histories = _solved_both(fs.TimeStepping(5e-3, alpha), gravity, basis)
    overall = [fs.find_events(history).displacement.overall for history in histories]
    if None in overall:
        raise VerificationError("the fingertip did not slip as a whole")
    for variables, allowed in ((_MOTIONS, basis.tolerance), (_ACCELERATIONS, basis.acceleration_tolerance)):
        for words, name in variables.items():
            yield _difference(words, histories, name, allowed)
    yield absolute("overall slip [s]", overall[0] or 0.0, overall[1] or 0.0, 1e-5)
    reduced = histories[1]
    imbalance = float(np.abs(reduced["energy_imbalance"].values).max() / reduced["external_work"].values.max())
    yield absolute("imbalance of energy / work", 0.0, imbalance, 1e-10)


def _static():
    """Without inertia the constraint modes are all there is, and the basis is exact."""
    histories = _solved_both(fs.QuasiStatic(5e-3), _WEIGHT, _LOOSE)
    for words, name in _MOTIONS.items():
        yield _difference(words, histories, name, 1e-8)


_TITLE = "Slip times of the fingertip of Table 2, refined in mesh, step and contact stiffness"
_SOURCE, _MODES = "Richardson's extrapolation, grid convergence index", "Craig & Bampton 1968"
PROBLEMS = (
    Problem("fingertip-refinement", _TITLE, _SOURCE, _refinement, slow=True),
    Problem("reduced-basis", "Fingertip in a reduced basis against that on the mesh", _MODES, _dynamic, _CASES),
    Problem("reduced-basis-static", "The same without inertia", _MODES, _static),
)
