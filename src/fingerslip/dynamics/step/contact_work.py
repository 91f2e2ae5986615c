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

    Arrays: displacement (n,) [m]; counterface (n_c,); counterfaces, counterfaces_before (n_counterfaces, dim) [m];
    moved_before (n_c, dim) [m]; forces, forces_before (n_c, dim) [N]; corrections (n_c, dim) [N]; returns moved (n_c,
    dim) [m]; inward, outward [J].
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
