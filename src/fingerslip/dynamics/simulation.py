"""Simulate models: from what they are to their histories, at once; :mod:`.steering.steering` goes step by step."""

from __future__ import annotations

import contextlib
import functools
import logging
import operator
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from fingerslip.arrays import Floats
from fingerslip.dynamics.motions import Motions, compute
from fingerslip.dynamics.recording.schedule import require_record_memory, step_times
from fingerslip.dynamics.reduced.basis import BasisStore, compute_in_basis
from fingerslip.dynamics.step.sharing import check_same_matrix
from fingerslip.dynamics.step.stepper import Stopwatch
from fingerslip.dynamics.system.bodies import contact_motion, largest_approach
from fingerslip.dynamics.system.system import build_system
from fingerslip.errors import InputError, SlipOutsideContactError
from fingerslip.libraries import xr
from fingerslip.linear.resources import allowed_threads, limited_threads, suitable_threads
from fingerslip.linear.solver import LinearSolver, preferred_solver
from fingerslip.model.model import Model
from fingerslip.model.timing import Adaptive
from fingerslip.parameters.schema import describe

# Share of the approach of the counterface that candidates are searched for in, in the first stage in 3D, where contact
# nodes decide what a simulation costs, and in the last, where that of the checks is too short. Measured on the shipped
# fingertip pressed by 2 mm: 0.91 in the press, up to 1.18 after 5 mm of slide in eight directions, as the pad rolls
# across. Too short a search costs all steps up to where that shows: every step tells whether a node outside touches.
_NEAR, _FAR = 1.25, 3.0
_HOW = "write fs.Model(mesh=..., materials=..., formulation=..., contacts=..., programme=..., time=...)"

_logger = logging.getLogger(__name__)

#: What receives the fraction that is done; True for a bar on standard error, False and None for nothing.
Progress = Callable[[float], None] | bool | None


@contextlib.contextmanager
def _shown_progress(progress: Progress) -> Iterator[Callable[[float], None] | None]:
    """Give what receives the fraction that is done; a bar is drawn as long as the block lasts."""
    if not isinstance(progress, bool) or not progress:
        yield progress or None
        return
    # Only a bar needs it.
    from rich import progress as bars
    from rich.console import Console

    text = bars.TextColumn
    columns = text("simulation"), bars.BarColumn(), text("{task.percentage:>3.0f} %"), bars.TimeElapsedColumn()
    with bars.Progress(*columns, text("left"), bars.TimeRemainingColumn(), console=Console(stderr=True)) as bar:
        task = bar.add_task("simulation", total=1.0)
        yield lambda fraction: bar.update(task, completed=fraction)


def simulate(
    model: Model,
    *,
    progress: Progress = None,
    threads: int | None = None,
    solver: LinearSolver | None = None,
    bases: BasisStore | None = None,
) -> xr.Dataset:
    """Compute the motion of a model.

    Parameters
    ----------
    model : Model
        What to compute.
    progress : callable or bool, optional
        Called after every step with the fraction that is done; True draws a bar on standard error.
    threads : int, optional
        Threads to use at most; without it as many as the cores that this process may use. Below about 15,000 degrees
        of freedom, in 2D 100,000, the algebra of a system takes one.
    solver : LinearSolver, optional
        What factorises the matrix; without it the preferred solver that is available, MKL PARDISO before SuperLU.
    bases : BasisStore, optional
        Where reduced bases are kept from run to run; without it they are made anew.

    Returns
    -------
    xarray.Dataset
        The history, with the variables of :data:`fingerslip.history.VARIABLES`.

    Raises
    ------
    InputError
        For a model that cannot be computed, before anything is.
    ConvergenceError
        Where the contact problem of a step was not solved to its tolerance.
    SlipOutsideContactError
        Where the boundary reaches a counterface at a node that is no candidate.

    Examples
    --------
    A disc presses a block of pulp and slides; then the same with less friction:

    >>> import dataclasses
    >>> import skfem
    >>> import fingerslip as fs
    >>> block = skfem.MeshQuad().refined(4).scaled(10e-3).with_defaults()
    >>> model = fs.Model(
    ...     mesh=block.with_subdomains({"pulp": lambda x: x[0] > 0.0}),
    ...     materials={"pulp": fs.material("pulp")},
    ...     formulation="plane_strain",
    ...     depth=10e-3,
    ...     supports={"top": ("x", "y")},
    ...     contacts=(fs.Contact("bottom", fs.Cylinder(radius=20e-3), fs.Coulomb(0.5)),),
    ...     programme=(fs.Press(depth=0.5e-3, speed=5e-3), fs.Slide(distance=2e-3, speed=10e-3)),
    ...     time=fs.TimeStepping(step=4e-3),
    ... )
    >>> events = fs.find_events(fs.simulate(model))
    >>> f"all of the contact slips at {events.overall:.2f} s, {1e3 * events.latency:.0f} ms after a tenth of it"
    'all of the contact slips at 0.27 s, 97 ms after a tenth of it'
    >>> smoother = dataclasses.replace(model, contacts=(fs.Contact("bottom", fs.Cylinder(20e-3), fs.Coulomb(0.3)),))
    >>> [round(fs.find_events(history).overall, 2) for history in fs.simulate_together([model, smoother])]
    [0.27, 0.17]
    """
    _require_model(model, "model")
    return simulate_together([model], progress=progress, threads=threads, solver=solver, bases=bases)[0]


def simulate_together(
    models: Sequence[Model],
    *,
    progress: Progress = None,
    threads: int | None = None,
    solver: LinearSolver | None = None,
    bases: BasisStore | None = None,
) -> tuple[xr.Dataset, ...]:
    """Compute the motions of models that differ in friction, programme or loads alone, step by step together.

    See :func:`simulate`.

    The matrix is factorised once, and every step is one substitution for all of them. Motions that are still the same,
    such as those of several sliding directions before the slide, are computed once. The histories are those of
    :func:`simulate`, but for rounding: in 3D that of factors of single precision, where motions alone have other
    contact candidates.

    Parameters
    ----------
    models : sequence of Model
        What to compute. Mesh, materials, supports, damping, step, counterfaces and penalties must be the same.
    progress : callable or bool, optional
        Called after every step with the fraction that is done; True draws a bar on standard error.
    threads : int, optional
        As for :func:`simulate`; the contacts of several motions are solved side by side.
    solver : LinearSolver, optional
        As for :func:`simulate`.
    bases : BasisStore, optional
        As for :func:`simulate`.

    Returns
    -------
    tuple of xarray.Dataset
        The history of each model. Its seconds are those of all of them together.

    Raises
    ------
    InputError
        For models that cannot share a matrix, and for all that :func:`simulate` refuses.
    ConvergenceError, SlipOutsideContactError
        As :func:`simulate`; the first failure ends all motions.
    """
    if isinstance(models, str) or not isinstance(models, Sequence):
        repair = "write [model], or simulate(model)" if isinstance(models, Model) else _HOW
        raise InputError("models", f"got {describe(models)}", "needs a list of models", repair)
    for number, model in enumerate(models):
        _require_model(model, f"models.{number}")
    check_same_matrix(models)
    times = [step_times(model) for model in models]
    allowed, mesh = allowed_threads(threads), models[0].mesh
    of_algebra = suitable_threads(mesh.p.size, allowed, mesh.dim())
    with limited_threads(of_algebra), _shown_progress(progress) as reporter:
        run = functools.partial(_simulate, times=times, progress=reporter, threads=allowed, solver=solver, bases=bases)
        return _in_stages(models, run)


def _in_stages(
    models: Sequence[Model], run: Callable[[Sequence[Model]], tuple[xr.Dataset, ...]]
) -> tuple[xr.Dataset, ...]:
    """Simulate in 3D with few contact candidates; again with all, and with more than the checks found, if too few."""
    near = [model if model.mesh.dim() == 2 else _with_search(model, _NEAR) for model in models]
    if not all(map(operator.is_, near, models)):
        try:
            return run(near)
        except InputError as error:
            # What else is wrong, such as a counterface that is too far away, the second stage says.
            if isinstance(error, SlipOutsideContactError):
                _logger.info("%s: starts again with more contact candidates", error)
    try:
        return run(models)
    except SlipOutsideContactError as error:
        farther = [_with_search(model, _FAR) for model in models]
        if all(map(operator.is_, farther, models)):
            raise
        _logger.info("%s: starts again with more contact candidates", error)
    return run(farther)


def _with_search(model: Model, share: float) -> Model:
    """Return a model whose automatic searches reach as far as a share of the approach of their counterfaces."""
    if model.is_loaded:
        return model
    contacts = []
    for number, contact in enumerate(model.contacts):
        approach = 0.0
        if contact.search_distance is None:
            # The checks of the model say what is wrong, and where.
            with contextlib.suppress(InputError):
                approach = largest_approach(contact_motion(model, number), contact.counterface)
        contacts.append(replace(contact, search_distance=share * approach) if approach > 0.0 else contact)
    return model if all(map(operator.is_, contacts, model.contacts)) else replace(model, contacts=tuple(contacts))


def _require_model(value: Any, where: str) -> None:
    if not isinstance(value, Model):
        raise InputError(where, f"got {describe(value)}", "needs a Model", _HOW)


def _simulate(
    models: Sequence[Model],
    *,
    times: Sequence[Floats],
    progress: Callable[[float], None] | None,
    threads: int,
    solver: LinearSolver | None,
    bases: BasisStore | None,
) -> tuple[xr.Dataset, ...]:
    watch = Stopwatch()
    with watch.part("assembly"):
        systems = [build_system(models[0])]
        systems += [build_system(model, systems[0]) for model in models[1:]]
    chosen = solver or preferred_solver()
    motions = Motions(tuple(models), tuple(systems), tuple(times), chosen, watch, progress, threads)
    require_record_memory(models[0], motions.record_bytes)
    basis, is_finite = models[0].basis, models[0].is_finite
    if is_finite and basis is not None:
        _logger.info("large strain is computed on the mesh, not in a reduced basis")
    if is_finite or any(isinstance(model.time, Adaptive) for model in models):
        # Their matrices are their own: one after the other.
        each = (motions.part(slice(number, number + 1)) for number in range(len(models)))
        return tuple(compute(motion, motion.systems).histories(watch)[0] for motion in each)
    outcome = (compute_in_basis(motions, bases) if basis else None) or compute(motions, systems)
    _logger.info("%s, %s", outcome.steppers[0].solver.name, outcome.steppers[0].condensed.description)
    return outcome.histories(watch)
