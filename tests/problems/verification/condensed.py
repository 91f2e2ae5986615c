"""The condensed solver against an independent one that keeps every degree of freedom.

The reference is :mod:`problems.verification.reference`: Newton's method on all displacements with dense matrices.
"""

import numpy as np

import fingerslip as fs
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.dynamics.recording.steps import step_times
from fingerslip.linear.resources import allowed_threads, limited_threads, suitable_threads
from fingerslip.verification.meshes import axes_of, box, components, dimension, formulation_of
from fingerslip.verification.problem import Problem, absolute
from problems.verification.reference import condensed_states, full_motions, full_system, make_stepper

_STEP, _ALPHA, _PENALTY, _MU = 2e-3, -0.05, 1e8, 0.4
# 7 % of critical damping in the block's first shear mode, at about 1300 rad/s.
_DAMPING = fs.RayleighDamping(mass=2.0, stiffness=1e-4)
_FIELDS = ("displacement", "velocity", "acceleration", "forces")
_SIDES = {2: (10e-3, 4e-3), 3: (10e-3, 6e-3, 4e-3)}
# Nodes along each side, of linear and of quadratic elements.
_COUNTS = {2: ((9, 4), (5, 3)), 3: ((5, 3, 3), (4, 2, 2))}


def _model(element, integration):
    """Return a soft block whose edges lift and slip first, pressed and dragged into overall slip."""
    dim = dimension(element)
    grids = map(np.linspace, (0.0,) * dim, _SIDES[dim], _COUNTS[dim][element in {"T6", "T10"}])
    up = fs.Plane(components(element, 0.0, 0.0, 1.0))
    return fs.Model(
        mesh=box(element, *grids),
        materials={"bulk": fs.Elastic(34e3, 0.45, 1000.0)},
        formulation=formulation_of(element),
        supports={"top": axes_of(element)},
        contacts=(fs.Contact("bottom", up, fs.Coulomb(_MU), _PENALTY, _PENALTY, search_distance=1.0),),
        programme=(fs.Press(0.3e-3, 3e-3), fs.Slide(4e-3, 20e-3)),
        time=fs.TimeStepping(_STEP, _ALPHA),
        damping=_DAMPING,
        integration=integration,
    )


def _everywhere(states, name, system):
    """Return a field on all degrees of freedom at every time, zero where they are held, shape (n_times, n_dofs)."""
    field = np.zeros((len(states), system.space.n_dofs))
    field[:, system.free] = [getattr(state, name) for state in states]
    return field


def compared(element, integration, solver=None):
    """Compare one element over a whole press and slide, at every node and every step."""
    model = _model(element, integration)
    stepper, times, full = make_stepper(model, solver), step_times(model), full_system(model)
    system = stepper.system
    with limited_threads(suitable_threads(len(full.mass), allowed_threads(), system.space.dim)):
        states = list(condensed_states(stepper, model))
        motions = full_motions(full, system.motions[0].displacement(times), times)
    fields = {name: _everywhere(states, name, system) for name in _FIELDS[:3]}
    fields["forces"] = np.stack([state.contact_forces for state in states])
    expected = {name: np.stack([getattr(motion, name) for motion in motions]) for name in _FIELDS}
    expected["forces"] = expected["forces"][:, np.searchsorted(full.nodes, system.candidates.nodes)]
    for name in _FIELDS:
        error = float(np.abs(fields[name] - expected[name]).max() / np.abs(expected[name]).max())
        yield absolute(f"{name}, largest difference / largest", 0.0, error, 1e-9)
    seen = {number for state in states for number in state.interface.state.tolist()}
    yield absolute("states that never occur", 0.0, len({OPEN, STICK, SLIP} - seen), 0.0)


def _cases(linear, *elements):
    """Return cases of some elements, and of nodal integration of linear ones."""
    return {element: (element, "selective") for element in elements} | {f"{linear} nodal": (linear, "nodal")}


_TITLE, _SOURCE = "Condensed solver against the full system", "Newton's method"
PROBLEMS = (
    Problem("condensed-2d", f"{_TITLE}, in 2D", _SOURCE, compared, _cases("T3", "Q4", "T3", "T6")),
    Problem("condensed-3d", f"{_TITLE}, in 3D", _SOURCE, compared, _cases("T4", "H8", "T4", "T10"), slow=True),
)
