"""Large strain against small strain, a free block that tumbles, and steps that are halved."""

import numpy as np

import fingerslip as fs
from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import mass_matrix
from fingerslip.fe.space import build_space
from fingerslip.verification.meshes import axes_of, box, components
from fingerslip.verification.problem import Problem, absolute, each, largest, solve_problem
from problems.verification.large_laws import BODIES, CASES, LENGTH, RAMP, body_model, small_limit


def _bent_block(body, case, load, kinematics):
    """Return the displacement of all nodes of a clamped block that a load bends and presses."""
    model = body_model(
        body,
        case.law,
        supports={"bottom": axes_of(body.element)},
        tractions={"top": components(body.element, 0.6 * load, 0.3 * load, -0.4 * load)},
        kinematics=kinematics,
        time=fs.QuasiStatic(1.0, end=1.0),
        record=fs.Recording(snapshots_every=1.0),
    )
    return np.asarray(fs.simulate(model)["snapshot_displacement"].values[-1])


def _small_limit(body, case):
    """Take loads that give strains of 4, 2 and 1 %."""
    small = _bent_block(body, case, 1.0, "small")
    loads = np.array([4.0, 2.0, 1.0]) * 1e-2 * LENGTH / np.abs(small).max()
    yield small_limit(lambda load: _bent_block(body, case, load, "finite"), small, loads)


#: The bodies, each with one of the laws.
PAIRS = {
    f"{body.name}, {case.name}": (body, case)
    for number, body in enumerate(BODIES)
    for case in [CASES[number % len(CASES)]]
}
_TUMBLE_STEP, _PUSHED = 2e-4, 0.02


def _tumbled(alpha, steps):
    """Return a free block that dead loads on its ends push and turn for 0.02 s, and its history."""
    ramp = fs.Ramp((0.0, 0.5 * _PUSHED, _PUSHED), (0.0, 1.0, 0.0))
    model = fs.Model(
        mesh=box("Q4", np.linspace(0.0, 2.0 * LENGTH, 5), np.linspace(0.0, LENGTH, 3)),
        materials={"bulk": fs.NeoHookean(30e3, 0.45, 1000.0)},
        formulation="plane_strain",
        tractions={"left": fs.Traction((0.0, -400.0), ramp), "right": fs.Traction((0.0, 480.0), ramp)},
        kinematics="finite",
        depth=LENGTH,
        time=fs.TimeStepping(_TUMBLE_STEP, alpha, end=steps * _TUMBLE_STEP),
        record=fs.Recording(snapshots_every=50 * _TUMBLE_STEP),
    )
    return model, fs.simulate(model)


def _momenta(model, history):
    """Return the momentum (n, 2) [N s] and the angular momentum about the origin (n,) [N m s] of all snapshots."""
    space = build_space(model.mesh)
    mass = mass_matrix(space, cell_materials(space, model.materials, model.formulation), model.depth)
    places = space.positions + history["snapshot_displacement"].values
    parts = np.stack([(mass @ own.ravel()).reshape(-1, 2) for own in history["snapshot_velocity"].values])
    turning = (places[..., 0] * parts[..., 1] - places[..., 1] * parts[..., 0]).sum(axis=1)
    return parts.sum(axis=1), turning


def _tumbling(alpha, allowed):
    """Let a block tumble through 10^4 steps, 17 turns a second, 290 steps a turn, at strains of up to 3 %.

    Momentum is kept to rounding: 1e-11. The trapezoidal rule keeps neither angular momentum nor energy of a body whose
    stiffness turns with it (Simo & Tarnow 1992): both sway with the second order of the step, by (omega h)^2 / 12 =
    4e-5; 1e-3 is allowed to the energy, whose fast part has coarser steps, and to the angular momentum. At -0.05 they
    also decay, with the third order: 1e-2 is allowed. Newton's method may leave 1e-6 of the forces in every step.
    """
    model, history = _tumbled(alpha, 10_000)
    free = history["snapshot_time"].values > _PUSHED
    momentum, turning = (values[free] for values in _momenta(model, history))
    energy = (history["kinetic_energy"] + history["strain_energy"]).values[history["time"].values > _PUSHED]
    left = np.abs(history["energy_imbalance"].values).max() / energy[0]
    lost = np.abs(momentum - momentum[0]).max() / np.abs(momentum[0]).max()
    yield absolute("change of momentum / momentum", 0.0, float(lost), 1e-11)
    yield largest("change of angular momentum", 1.0, turning / turning[0], allowed)
    yield largest("change of energy / energy", 1.0, energy / energy[0], allowed)
    yield absolute("energy out of balance / energy", 0.0, float(left), 1e-4)


def _crushed(element, steps):
    """Return the history of a block whose top is pressed to half its height."""
    grid = np.linspace(0.0, LENGTH, 7)
    model = fs.Model(
        mesh=box(element, grid, grid),
        materials={"bulk": fs.NeoHookean(34e3, 0.48, 1000.0)},
        formulation="plane_strain",
        supports={"bottom": ("x", "y"), "top": ("x", "y")},
        support_motions={"top": fs.SupportMotion((0.0, -0.4 * LENGTH), RAMP)},
        integration="nodal" if element == "T3" else "selective",
        kinematics="finite",
        time=fs.QuasiStatic(1.0 / steps, end=1.0),
        record=fs.Recording(snapshots_every=1.0),
    )
    return solve_problem(model)


def _halving(element):
    """Crush a block by 40 % in one step, which fails and is halved, and in 64: ten times Newton's tolerance."""
    once, often = _crushed(element, 1), _crushed(element, 64)
    yield absolute("whether the step was halved", 1.0, float(once.attrs["halved_steps"] > 0), 0.0)
    yield absolute("whether the small ones were", 0.0, float(often.attrs["halved_steps"] > 0), 0.0)
    for words, name in (
        ("displacement, largest difference / largest", "snapshot_displacement"),
        ("forces of supports, difference / largest", "support_force"),
    ):
        yield largest(words, often[name].values[-1], once[name].values[-1], 1e-5)


_SMALL, _HALVED = "Large strain at small loads", "A step that fails is halved"
_DECAYS = {"alpha = 0": (0.0, 1e-3), "alpha = -0.05": (-0.05, 1e-2)}
PROBLEMS = (
    Problem("small-limit", _SMALL, "Taylor's series", _small_limit, PAIRS),
    Problem("tumbling-block", "Free block that tumbles", "Newton; Simo & Tarnow 1992", _tumbling, _DECAYS, slow=True),
    Problem("halved-step", _HALVED, "Elastic bodies have no path", _halving, each("Q4", "T3", "T6")),
)
