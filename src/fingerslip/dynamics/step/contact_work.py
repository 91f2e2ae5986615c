"""The motion of the contact candidates in a step and the work of their forces, compiled."""

from __future__ import annotations

import numba

from fingerslip.dynamics.system.operators import relative_motion

__all__ = ["contact_work"]


@numba.njit(cache=True, nogil=True)
def contact_work(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    relative,
    displacement,
    counterface,
    counterfaces,
    counterfaces_before,
    moved_before,
    forces,
    forces_before,
    corrections,
):
    """Return where the candidates are relative to their counterfaces, the work on the interface, and of counterfaces.

    Both works are those of the mean forces of the step.

    Parameters
    ----------
    relative : tuple of arrays
        A :func:`~fingerslip.dynamics.system.operators.relative_operator`, as
        :func:`~fingerslip.linear.products.compiled_parts` gives it.
    displacement : (n,) array
        Displacement of the unknowns at the end of the step [m].
    counterface : (n_c,) array
        Index of the counterface of each candidate.
    counterfaces, counterfaces_before : (n_counterfaces, dim) array
        Prescribed displacement of the counterfaces at the end and at the start [m].
    moved_before : (n_c, dim) array
        Displacement of the candidates relative to their counterfaces at the start [m].
    forces, forces_before : (n_c, dim) array
        Contact forces at the end and at the start, in global components [N].
    corrections : tuple of two (n_c, dim) arrays
        What dropped forces leave beside them at the start and at the end [N]; arrays of no size where they leave none.

    Returns
    -------
    moved : (n_c, dim) array
        As `moved_before`, at the end [m].
    inward, outward : float
        Work on the interface and work of the counterfaces' prescribed motion [J].
    """
    starts, columns, values = relative
    moved = relative_motion(starts, columns, values, displacement, counterfaces, counterface)
    inward = outward = 0.0
    for i in range(moved.shape[0]):
        face = counterface[i]
        for k in range(moved.shape[1]):
            acting = forces_before[i, k] + forces[i, k]
            for correction in corrections:
                if correction.size:
                    acting += correction[i, k]
            inward -= 0.5 * acting * (moved[i, k] - moved_before[i, k])
            outward += 0.5 * acting * (counterfaces[face, k] - counterfaces_before[face, k])
    return moved, inward, outward
