"""Blocks on a plate: laws of friction, friction that does not creep, and blocks that nothing else holds."""

import numpy as np

import fingerslip as fs
from fingerslip.contact.states import SLIP
from fingerslip.verification.blocks import PRESSURE, SHEAR_STIFFNESS, block_on_plate, drag_block
from fingerslip.verification.meshes import axes_of, components
from fingerslip.verification.problem import Problem, absolute, each, relative, solve_problem

# 20 um of press give the pressure of the module blocks.
_DEPTH = 20e-6
# Friction that falls with the slip rate slides steadily only where it falls slowly enough: the law's slope times the
# pressure has to be below the shear stiffness times the step, here by a factor of 0.4, which also is what each step
# leaves of a disturbance.
_STATIC_KINETIC = fs.StaticKinetic(0.5, 0.45, 2e-3)
_POWER = fs.PressureDependent(0.5, PRESSURE, -1 / 3)
_ELLIPSE = fs.Anisotropic(0.6, 0.3)
_DIRECTION = (1.0, 1.0, 0.0)
# A quarter of the shear stiffness, per area: slip is steady.
_WEAKENING = fs.SlipWeakening(0.5, 0.3, 0.4e-3)


def _tractions(law, element, depth=_DEPTH, speed=1e-3, step=-1):
    """Return the friction traction [Pa] of the uniform contact along x, at a step."""
    history = drag_block(element, law, depth=depth, speed=speed)
    return float(history["tangential_traction"].values[step, :, 0].mean())


def _laws():
    """Uniform pressure and slip rate: the laws hold at every node to rounding once all slip steadily."""
    rate = 1e-3
    falling = 0.45 + 0.05 * float(np.exp(-rate / 2e-3))
    for element in ("Q4", "H8"):
        yield relative(f"{element} Coulomb: t / p", 0.5, _tractions(fs.Coulomb(0.5), element) / PRESSURE, 1e-9)
        kinetic = _tractions(_STATIC_KINETIC, element) / PRESSURE
        yield relative(f"{element} StaticKinetic: t / p", falling, kinetic, 1e-6)
        doubled = _tractions(_POWER, element, depth=2 * _DEPTH) / (2 * PRESSURE)
        name = f"{element} PressureDependent: t / p at twice the reference pressure"
        yield relative(name, 0.5 * 2 ** (-1 / 3), doubled, 1e-9)
    yield from _directions()


def _directions():
    """Drag along the diagonal: Coulomb's traction follows it, the ellipse's has slip as its normal.

    The normal rule gives t = p (mu_1^2 d_1, mu_2^2 d_2) / sqrt(mu_1^2 d_1^2 + mu_2^2 d_2^2) for slip along d. The
    traction turns to that over slides of mu p / k = 0.25 mm; after 4 mm exp(-16) = 1e-7 is left.
    """
    round_ = drag_block("H8", fs.Coulomb(0.5), direction=_DIRECTION)["counterface_force"].values[-1, 0]
    oval = drag_block("H8", _ELLIPSE, direction=_DIRECTION, travel=4e-3)["counterface_force"].values[-1, 0]
    scale = float(np.hypot(0.6, 0.3))
    yield relative("H8 Coulomb, diagonal: F / N", 0.5, float(np.hypot(round_[0], round_[1]) / round_[2]), 1e-9)
    yield relative("H8 Coulomb, diagonal: F_y / F_x", 1.0, float(round_[1] / round_[0]), 1e-9)
    yield relative("H8 Anisotropic, diagonal: F_x / N", 0.36 / scale, float(oval[0] / oval[2]), 1e-5)
    yield relative("H8 Anisotropic, diagonal: F_y / N", 0.09 / scale, float(oval[1] / oval[2]), 1e-5)


def _slope(of, at):
    """Return the central difference with a relative step of 1e-4."""
    change = 1e-4 * at
    return (of(at + change) - of(at - change)) / (2 * change)


def _tangents():
    """Take central differences of whole simulations on both sides of stick and slip.

    Their own error is the square of the relative step 1e-4, and rounding over it: 1e-6.
    """
    rate = 1e-3
    falling = -(0.05 / 2e-3) * float(np.exp(-rate / 2e-3)) * PRESSURE

    def by_pressure(law, element, step):
        return _slope(lambda depth: _tractions(law, element, depth=depth, step=step), _DEPTH) * _DEPTH / PRESSURE

    for element in ("Q4", "H8"):
        # The third step of the slide, at 60 um, sticks: its traction follows the slide and not the pressure.
        history = drag_block(element, fs.Coulomb(0.5))
        slid = history.isel(time=slice(1, None))  # the press moves nothing along
        moved = slid["counterface_displacement"].values[:, 0, 0]
        slopes = np.diff(slid["tangential_traction"].values[:, 0, 0]) / np.diff(moved)
        yield relative(f"{element} stick: dt / ds [MPa/m]", SHEAR_STIFFNESS / 1e6, float(slopes[2]) / 1e6, 1e-6)
        yield absolute(f"{element} slip: dt / ds [MPa/m]", 0.0, float(slopes[-1]) / 1e6, 1e-6)
        yield absolute(f"{element} stick: dt / dp", 0.0, by_pressure(fs.Coulomb(0.5), element, 3), 1e-6)
        yield relative(f"{element} slip, Coulomb: dt / dp", 0.5, by_pressure(fs.Coulomb(0.5), element, -1), 1e-6)
        yield relative(f"{element} slip, PressureDependent: dt / dp", 1 / 3, by_pressure(_POWER, element, -1), 1e-6)
        by_rate = _slope(lambda speed, own=element: _tractions(_STATIC_KINETIC, own, speed=speed), rate)
        yield relative(f"{element} slip, StaticKinetic: dt / dv [Pa s/m]", falling, by_rate, 1e-4)


def _weakening(element):
    """Friction that falls with slip, on a contact that slips uniformly and steadily.

    Slip s and slide u balance where K (u - s) = mu(s) p. The law takes the slip at the start of a step, so friction is
    late by the slip of a step: first order, and the work is too large by that slip over the distance.
    """
    law = _WEAKENING
    slope = (law.static - law.kinetic) / law.distance
    slide = 0.4e-3
    slip = (SHEAR_STIFFNESS * slide - law.static * PRESSURE) / (SHEAR_STIFFNESS - slope * PRESSURE)
    expected = (law.static - slope * slip) * PRESSURE
    coarse, fine = (drag_block(element, law, steps=steps) for steps in (200, 400))
    traction, slipped = (fine[name].values for name in ("tangential_traction", "slip_distance"))
    line = law.static - slope * np.minimum(slipped[:-1], law.distance)
    error = np.where(fine["contact_state"].values[1:] == SLIP, traction[1:, :, 0] - line * PRESSURE, 0.0)
    load = PRESSURE * float(fine["contact_area"].sum())
    work = float(fine["friction_dissipation"][-1]) - law.kinetic * load * float(slipped[-1].mean())
    errors = [_traction_at(slide, history) - expected for history in (coarse, fine)]
    weakened = work / (load * law.distance)
    yield absolute("t / p off the line, at the slip before the step", 0.0, np.abs(error).max() / PRESSURE, 1e-9)
    yield relative("t / p at the end", law.kinetic, float(traction[-1, :, 0].mean()) / PRESSURE, 1e-9)
    yield relative("t / p at 0.4 mm", expected / PRESSURE, _traction_at(slide, fine) / PRESSURE, 0.01)
    yield relative("order of the error of that", 1.0, float(np.log2(errors[0] / errors[1])), 0.02)
    yield relative("work of weakening / (N distance)", (law.static - law.kinetic) / 2, weakened, 0.01)


def _traction_at(slide, history):
    """Return the friction traction after a slide [Pa]."""
    slides = history["counterface_displacement"].values[:, 0, 0]
    return float(np.interp(slide, slides, history["tangential_traction"].values[:, :, 0].mean(axis=1)))


# Stuck blocks stay where they are for an hour, just below the limit of friction. What they move beyond their elastic
# slip, the stretch t / k_t of the tangential penalties, is slip: there must be none.
_LENGTH, _MODULUS, _PENALTY, _MU = 10e-3, 34e3, 1e8, 0.5
_PLATE = {"friction": fs.Coulomb(_MU), "normal_penalty": _PENALTY, "tangential_penalty": _PENALTY}
_HEIGHT, _SHARE = 4e-3, 0.99
_SHEAR = _SHARE * _MU * PRESSURE
_STEP, _RAMP, _HOUR = 1.0, 300.0, 3600.0
# So heavy that it shears to and fro once in about six steps.
_HEAVY = 2e9


def _left_alone(element, programme, supports, *, pull=0.0, density=1000.0, alpha=-0.05):
    """Return what happens to a block until an hour after a ramp of the plate's travel, or of a pull [Pa] on its top."""
    ramp = fs.Ramp((10 * _STEP, 10 * _STEP + _RAMP), (0.0, 1.0))
    model = block_on_plate(
        element,
        *(np.linspace(0, _LENGTH, 6), np.linspace(0, _LENGTH, 3), np.linspace(0, _HEIGHT, 3)),
        material=fs.Elastic(_MODULUS, 0.0, density),
        plate=_PLATE,
        supports=supports,
        tractions={"top": fs.Traction(components(element, pull, 0.0, 0.0), ramp)} if pull else {},
        programme=programme,
        time=fs.TimeStepping(_STEP, alpha, end=10 * _STEP + _RAMP + _HOUR),
    )
    return solve_problem(model)


def _drift_and_share(history):
    """Return what happens in the hour after the load has reached its end.

    That is the longest way that any contact node slips on the plate [m], beyond its elastic slip, along and across the
    load, from the start to any later time; and the tangential over the largest frictional force [-].
    """
    hour = history["time"].values >= (10 * _STEP + _RAMP) * (1 - 1e-9)
    elastic = -history["tangential_traction"].values / _PENALTY
    moved = history["contact_displacement"].values - history["counterface_displacement"].values
    slip = (moved[:, :, : elastic.shape[-1]] - elastic)[hour]
    force = history["counterface_force"].values[hour, 0]
    drift = float(np.linalg.norm(slip - slip[0], axis=-1).max())
    return drift, np.abs(force[:, 0]) / (_MU * np.abs(force[:, -1]))


def _creep(element, name):
    """Allow a nanometre in an hour, where the elastic slip is 10 um.

    In the first three all nodes are held along the normal, so that pressure and traction are uniform and known. The
    last is held at its upper side alone: it leans, its rear sticks least, and its nodes slip one after the other until
    this travel of the plate, found to four digits, has brought it to the same share of overall slip. Without damping
    the ramp leaves a swing of a few millionths.
    """
    *across, up = axes_of(element)
    press, wait, travel = fs.Press(_DEPTH, _DEPTH / _STEP), fs.Hold(9 * _STEP), _SHEAR / SHEAR_STIFFNESS
    deep, far = PRESSURE * (_HEIGHT / _MODULUS + 1 / _PENALTY), 1.577 * travel
    held, leaning = {"bulk": (up,)}, {"top": (*across, up)}
    match name:
        case "pulled":
            history = _left_alone(element, (press,), held, pull=_SHEAR, alpha=0.0)
        case "dragged":
            slide = fs.Slide(travel, travel / _RAMP)
            history = _left_alone(element, (press, wait, slide), held | {"top": tuple(across)})
        case "swinging":
            history = _left_alone(element, (press,), held, pull=_SHEAR, density=_HEAVY)
        case _:
            deeper = fs.Press(deep, deep / _STEP), wait, fs.Slide(far, far / _RAMP)
            history = _left_alone(element, deeper, leaning)
    drift, share = _drift_and_share(history)
    yield absolute("drift in an hour [m]", 0.0, drift, 1e-9)
    yield relative("F / (mu N) at the end", _SHARE, float(share[-1]), 1e-3 if name == "leaning" else 1e-5)
    if name == "swinging":
        # The load stops rising after a time T; the shear wave of speed c that says so comes to the plate H / c later,
        # and till then the traction has gone on rising: by H / (c T). The penalty's layer counts as G / k_t of height.
        shear_modulus = _MODULUS / 2
        speed = np.sqrt(shear_modulus / _HEAVY)
        overshoot = float((_HEIGHT + shear_modulus / _PENALTY) / (speed * _RAMP))
        yield relative("overshoot after the ramp", overshoot, float(share.max()) / _SHARE - 1.0, 0.1)


_GRAVITY, _BLOCK_HEIGHT = 9.81, 5e-3
_WEIGHT = 1000.0 * _GRAVITY * _BLOCK_HEIGHT


def _rested(element, *, pull=0.0, held=()):
    """Return the history of a block that is dropped from 0.1 mm and pulled on its right side by `pull` [Pa]."""
    up, side = components(element, 0.0, 0.0, 1.0), np.linspace(0.0, _LENGTH, 9)
    model = block_on_plate(
        element,
        *(side, side, np.linspace(0.0, _BLOCK_HEIGHT, 5)),
        material=fs.Elastic(1e5, 0.0, 1000.0),
        plate=_PLATE | {"counterface": fs.Plane(up, -1e-4)},
        supports={"left": held} if held else {},
        gravity=tuple(-_GRAVITY * component for component in up),
        tractions={"right": components(element, pull, 0.0, 0.0)},
        time=fs.QuasiStatic(0.1, end=0.3),
    )
    return solve_problem(model)


def _rest(element):
    """Without inertia only gravity and friction hold the block; the pull is 0.8 of the friction of its weight."""
    pull = 0.8 * _MU * _WEIGHT * _LENGTH / _BLOCK_HEIGHT
    width = 1.0 if element == "Q4" else _LENGTH
    weight, pulling = _WEIGHT * _LENGTH * width, pull * _BLOCK_HEIGHT * width
    free, pulled, guided = _rested(element), _rested(element, pull=pull), _rested(element, held=("x",))
    force = pulled["counterface_force"].values[-1, 0]
    sheared = np.average(pulled["contact_displacement"].values[-1, :, 0], weights=pulled["contact_area"].values)
    for quantity, expected, got in (
        ("weight on the plate [N]", weight, free["counterface_force"].values[-1, 0, -1]),
        ("depth in the plate [m]", _WEIGHT / _PENALTY, -free["gap"].values[-1].mean()),
        ("friction against a pull [N]", pulling, -force[0]),
        ("weight on the plate under a pull [N]", weight, force[-1]),
        ("mean slip of the springs [m]", pulling / (_PENALTY * _LENGTH * width), sheared),
        ("weight on the plate, held along x [N]", weight, guided["counterface_force"].values[-1, 0, -1]),
    ):
        yield relative(quantity, expected, got, 1e-8)


_BOTH, _THEMSELVES = each("Q4", "H8"), "The laws themselves"
_HELD = {
    f"{element} {name}": (element, name) for element in _BOTH for name in ("pulled", "dragged", "swinging", "leaning")
}
PROBLEMS = (
    Problem("resting-block", "Block on a plate, held by nothing else", "statics", _rest, _BOTH),
    Problem("friction-laws", "Every friction law on a uniform contact", _THEMSELVES, _laws),
    Problem("friction-tangents", "Derivatives of friction in stick and slip", _THEMSELVES, _tangents),
    Problem("slip-weakening", "Friction that falls with slip", "Ida 1972; Palmer & Rice 1973", _weakening, _BOTH),
    Problem("creep", "Block held for an hour at 0.99 mu N", "Coulomb's law", _creep, _HELD, slow=True),
)
