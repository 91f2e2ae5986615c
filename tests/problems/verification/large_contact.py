"""A cylinder pressed deep into a neo-Hookean block and dragged, beside a second program's result."""

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Problem, relative, solve_problem

_WIDTH, _HEIGHT, _RADIUS, _DEPTH, _TRAVEL = 24e-3, 8e-3, 4e-3, 2.5e-3, 3e-3
_SHEAR, _RATIO, _PENALTY, _FRICTION = 10e3, 0.45, 1e9, 0.3
_MATERIAL = fs.NeoHookean(2.0 * _SHEAR * (1.0 + _RATIO), _RATIO, 1000.0)
# What `python tests/physics/independent_block.py 12 40` prints, for shares of the press and of the slide: the force on
# the block per depth along the slide and across it [N/m].
REFERENCE = (
    (0.25, 0.0, 0.0, -17.190144),
    (0.5, 0.0, 0.0, -44.659674),
    (0.75, 0.0, 0.0, -81.258658),
    (1.0, 0.0, 0.0, -127.588006),
    (1.0, 0.25, 15.084677, -125.346912),
    (1.0, 0.5, 28.943811, -122.920773),
    (1.0, 0.75, 41.063277, -120.487669),
    (1.0, 1.0, 49.299583, -118.705032),
)


def dragged_cylinder(cells, steps, *, material=_MATERIAL, penalty=_PENALTY, friction=_FRICTION):
    """Return the history of a block, clamped at its bottom, under a cylinder that is pressed in and dragged."""
    side = np.linspace(0.0, 1.0, cells + 1)
    half = 0.5 * _WIDTH * (0.5 * side + 0.5 * side**3)
    face = fs.Cylinder(_RADIUS, normal=(0.0, -1.0), centre=(0.0, _HEIGHT + _RADIUS))
    model = fs.Model(
        mesh=box("Q4", np.concatenate([-half[:0:-1], half]), _HEIGHT * (1.0 - (1.0 - side) ** 1.3)),
        materials={"bulk": material},
        formulation="plane_strain",
        supports={"bottom": ("x", "y")},
        contacts=(fs.Contact("top", face, fs.Coulomb(friction), penalty, penalty, search_distance=_HEIGHT),),
        programme=(fs.Press(_DEPTH, _DEPTH), fs.Slide(_TRAVEL, _TRAVEL, (1.0, 0.0))),
        kinematics="finite",
        time=fs.QuasiStatic(1.0 / steps),
    )
    # Under the cylinder's peak pressure of some G, the penalty gives way by tens of micrometres.
    return solve_problem(model, penetration=1e-4)


def _dragged():
    """Compare forces on another mesh of other elements, at the same steps: 1 % of the force while pressing.

    Both are within some tenths of a per cent of their finer meshes there; friction at the edge of the patch, which one
    program has at nodes and the other between them, is allowed 2 %.
    """
    steps = 40
    history = dragged_cylinder(32, steps)
    for press, slide, along, down in REFERENCE:
        force = history["counterface_force"].values[round((press + slide) * steps), 0]
        name = f"{100 * press:.0f} % pressed" if press < 1.0 or not slide else f"{100 * slide:.0f} % dragged"
        yield relative(f"{name}: force down [N/m]", down, float(force[1]), 0.01)
        if slide:
            yield relative(f"{name}: force along [N/m]", along, float(force[0]), 0.02)


_TITLE, _SOURCE = "Cylinder pressed deep and dragged", "Own second program, tests/physics/independent_block.py"
PROBLEMS = (Problem("dragged-cylinder", _TITLE, _SOURCE, _dragged),)
