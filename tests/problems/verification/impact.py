"""A rod of two materials that strikes a rigid wall: contact must not make energy, however stiff it is."""

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import box
from fingerslip.verification.problem import Problem, absolute, solve_problem

_LENGTH, _CELLS, _MODULUS, _DENSITY, _SPEED = 0.1, 60, 1e6, 1000.0, 0.1
_STIFFER = 15.0
_MODULI = {"soft": _MODULUS, "stiff": _STIFFER * _MODULUS}
_ALPHAS = (0.0, -0.05, -0.1, -0.2, -1 / 3, -0.41421, -0.5)
#: Penalty stiffness over that of the element at the wall.
_PENALTIES = (1.0, 20.0, 1e3, 1e5)


def _thrown(alpha, penalty):
    """Return the history of a rod, its half at the wall soft, with steps of half a wave's time through a soft cell."""
    size = _LENGTH / _CELLS
    mesh = box("Q4", np.array([0.0, size]), np.linspace(0.0, _LENGTH, _CELLS + 1))
    mesh = mesh.with_subdomains({"soft": lambda x: x[1] < _LENGTH / 2, "stiff": lambda x: x[1] > _LENGTH / 2})
    step = 0.5 * size * (_DENSITY / _MODULUS) ** 0.5
    contact = fs.Contact(
        "bottom", fs.Plane((0.0, 1.0), -1e-4), fs.Coulomb(0.0), normal_penalty=penalty * _MODULUS / size
    )
    return solve_problem(
        fs.Model(
            mesh=mesh,
            materials={name: fs.Elastic(modulus, 0.0, _DENSITY) for name, modulus in _MODULI.items()},
            formulation="plane_stress",
            contacts=(contact,),
            initial_velocity=(0.0, -_SPEED),
            time=fs.TimeStepping(step, alpha, end=8 * _CELLS * step),
        ),
        penetration=_LENGTH,
    )


def _impact():
    """Rounding of 480 steps may add up to 1e-11; a step of half a wave's time costs 1 % of the energy, allowed are 2 %.

    The rod has left the wall by the end: what is left of its energy is kinetic and strain energy.
    """
    for alpha in _ALPHAS:
        ratios = [_energy_ratios(_thrown(alpha, penalty)) for penalty in _PENALTIES]
        at = f"alpha = {alpha:.3g}"
        yield absolute(f"{at}: most energy / initial", 1.0, max(most for most, _ in ratios), 1e-11)
        yield absolute(f"{at}: least energy left / initial", 1.0, min(last for _, last in ratios), 0.02)


def _energy_ratios(history):
    """Return the largest and the last energy of body and contact over the first [-]."""
    energy = np.sum([history[name].values for name in ("kinetic_energy", "strain_energy", "contact_energy")], axis=0)
    assert history["contact_state"].values[-1].max() == 0
    return float(energy.max() / energy[0]), float(energy[-1] / energy[0])


PROBLEMS = (Problem("impact", "Rod of two materials thrown at a wall", "Conservation of energy", _impact),)
