"""The reduced basis against the mesh: the same motion of the fingertip, in both."""

import dataclasses

import numpy as np

import fingerslip as fs
from fingerslip.verification.problem import Problem, VerificationError, absolute, solve_problem

_SIZES = (0.15e-3, 0.4e-3)
_LOOSE, _TIGHT = fs.ReducedBasis(1e-4, 5e-3), fs.ReducedBasis(1e-5, 1e-3)
_WEIGHT = (0.0, -9.81)
# Numerical damping of the shipped studies, and the default one; a weight that acts at once is not in the basis.
_CASES = {
    f"alpha {alpha:g}{', weight' if gravity else ''}, tolerance {basis.tolerance:g}": (alpha, gravity, basis)
    for alpha, gravity, basis in ((-0.41421, None, _TIGHT), (-0.41421, _WEIGHT, _TIGHT), (-0.05, None, _LOOSE))
}
_MOTIONS = {"contact displacement": "contact_displacement", "displacement at sites": "displacement"}
_FOLLOWING = {
    "slip distance": "slip_distance",
    "traction": "tangential_traction",
    "strain energy density at sites": "strain_energy_density",
}
_ACCELERATIONS = {"acceleration of the contact": "contact_acceleration", "acceleration of sites": "acceleration"}


def _model(time, gravity=None):
    """Return the fingertip of Table 2, pressed and slid until it slips as a whole, on a coarse mesh."""
    finger = fs.preset("wang2014-2d")
    sites = tuple(fs.Site(f"below {x:g} mm", "", (1e-3 * x, -5e-3), None) for x in (-8, -5, -2))
    return fs.Model(
        mesh=fs.build_section(finger, contact_size=_SIZES[0], bulk_size=_SIZES[1]),
        materials=finger.materials,
        formulation=finger.formulation,
        depth=finger.depth,
        supports={"phalanx": ("x", "y")},
        contacts=(fs.Contact("skin", fs.Plane(normal=(0.0, 1.0)), fs.Coulomb(0.6)),),
        programme=(fs.Press(1.5e-3, 1.5e-3), fs.Slide(distance=3e-3, speed=3e-3)),
        time=time,
        record=fs.Recording(sites),
        gravity=gravity,
    )


def _size(found, expected, name):
    """Return the root of the mean square of a difference over that of the variable."""
    one, other = found[name].values, expected[name].values
    return float(np.linalg.norm(one - other) / np.linalg.norm(other))


def _solved_both(full, basis):
    reduced = solve_problem(dataclasses.replace(full, basis=basis))
    if reduced.attrs["basis"] != "reduced":
        raise VerificationError("the motion was not computed in a reduced basis")
    return solve_problem(full), reduced


def _dynamic(alpha, gravity, basis):
    """Hold the errors of a motion in a reduced basis against the tolerances that it was given."""
    full, reduced = _solved_both(_model(fs.TimeStepping(5e-3, alpha), gravity), basis)
    overall = [fs.find_events(history).displacement.overall for history in (full, reduced)]
    if None in overall:
        raise VerificationError("the fingertip did not slip as a whole")
    for words, name in (_MOTIONS | _FOLLOWING | _ACCELERATIONS).items():
        allowed = basis.acceleration_tolerance if words in _ACCELERATIONS else basis.tolerance
        yield absolute(f"{words}, rms error / rms", 0.0, _size(reduced, full, name), allowed)
    yield absolute("overall slip [s]", overall[0] or 0.0, overall[1] or 0.0, 1e-5)
    imbalance = float(np.abs(reduced["energy_imbalance"].values).max() / reduced["external_work"].values.max())
    yield absolute("imbalance of energy / work", 0.0, imbalance, 1e-10)


def _static():
    """Without inertia the constraint modes are all there is, and the basis is exact."""
    full, reduced = _solved_both(_model(fs.QuasiStatic(5e-3), _WEIGHT), _LOOSE)
    for words, name in (_MOTIONS | _FOLLOWING).items():
        yield absolute(f"{words}, rms error / rms", 0.0, _size(reduced, full, name), 1e-8)


_SOURCE = "Craig & Bampton 1968"
PROBLEMS = (
    Problem("reduced-basis", "Fingertip in a reduced basis against that on the mesh", _SOURCE, _dynamic, _CASES),
    Problem("reduced-basis-static", "The same without inertia", _SOURCE, _static),
)
