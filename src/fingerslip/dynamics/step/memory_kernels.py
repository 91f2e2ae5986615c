"""The passes over the nodes of :mod:`fingerslip.dynamics.step.memory`, compiled.

Arguments are the fields of :class:`~fingerslip.dynamics.step.memory.Memory` at the start of a step and, in their order,
those at its end, which are filled but for the displacement, which is given. Both passes return the energy that is
stored beside that of the elastic stiffness, twice the work of the mean displacement on the dashpots, and the sum of
s_i z_i.D z_i.
"""

from __future__ import annotations

import numba

__all__ = ["across_and_along", "along", "remembered_force"]


@numba.njit(cache=True, nogil=True)
def remembered_force(of_given, of_dashpots, thinning, strains, dashpots, across, across_dashpots, force):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Fill in the force (n,) that follows from the start of a step, S m + T (mu - thinning (m + 2 mu))."""
    weight = of_given.sum()
    plane = across.shape[0] > 0
    for j in range(force.size):
        total = weight * strains[1, j]
        for i in range(of_dashpots.size):
            total += of_dashpots[i] * dashpots[i, 1, j]
        if plane:
            strain, thin = weight * strains[2, j], weight * across[1, j]
            for i in range(of_dashpots.size):
                strain += of_dashpots[i] * dashpots[i, 2, j]
                thin += of_dashpots[i] * across_dashpots[i, 1, j]
            total += thin - thinning * (strain + 2.0 * thin)
        force[j] = total


@numba.njit(cache=True, nogil=True)
def along(shares, decay, end, start, given0, dashpots0, relaxed0, strains, dashpots, relaxed):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Follow a step in solids and plane strain, where the deviator's stiffness is S."""
    _follow(shares, decay, end, start, given0, dashpots0, strains, dashpots, relaxed)
    whole = moved = total = 0.0
    for j in range(strains.shape[1]):
        pull = relaxed[1, j]
        whole += strains[0, j] * pull
        moved += (given0[0, j] + strains[0, j]) * (pull - relaxed0[1, j])
        of_terms = 0.0
        for i in range(shares.size):
            of_terms += shares[i] * dashpots[i, 0, j] * dashpots[i, 1, j]
        total += of_terms
    return 0.5 * total - whole, moved, total


@numba.njit(cache=True, nogil=True)
def across_and_along(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    shares,
    decay,
    end,
    start,
    shares_of_bulk,
    given0,
    dashpots0,
    relaxed0,
    across0,
    across_dashpots0,
    across_relaxed0,
    strains,
    dashpots,
    relaxed,
    across,
    across_dashpots,
    across_relaxed,
):
    """Follow a step in plane stress; `parts` are those of w_1, its part of u at once, and the bulk modulus over 2 G.

    The deviator's stiffness D makes u.D u' = u.S u' + w.T w' - (u - w).T (u' - w')/3.
    """
    now, earlier, at_once, bulk = shares_of_bulk
    _follow(shares, decay, end, start, given0, dashpots0, strains, dashpots, relaxed)
    # What of the dashpots follows from the start of the step: all but that of the displacement at its end.
    share = (shares * end).sum()
    across_relaxed[:] = 0.0
    for i in range(shares.size):
        for k in range(2):
            for j in range(strains.shape[1]):
                predicted = start[i] * across0[k, j] + decay[i] * across_dashpots0[i, k, j]
                across_relaxed[k, j] += shares[i] * predicted
    for k in range(2):
        for j in range(strains.shape[1]):
            remembered = relaxed[2 * k, j] - share * strains[2 * k, j] + 2.0 * across_relaxed[k, j]
            across[k, j] = now * strains[2 * k, j] + earlier * remembered
    _follow(shares, decay, end, start, across0, across_dashpots0, across, across_dashpots, across_relaxed)
    whole = moved = total = elastic = 0.0
    for j in range(strains.shape[1]):
        u, w, thick, thinned = strains[0, j], across[0, j], strains[2, j], across[1, j]
        pull, push = relaxed[1, j], across_relaxed[1, j]
        apart = relaxed[2, j] - push
        u0, w0, apart0 = given0[0, j], across0[0, j], relaxed0[2, j] - across_relaxed0[1, j]
        whole += u * pull + w * push - (u - w) * apart / 3.0
        change = (u0 + u) * (pull - relaxed0[1, j]) + (w0 + w) * (push - across_relaxed0[1, j])
        moved += change - (u0 + u - w0 - w) * (apart - apart0) / 3.0
        elastic += w * thinned + (bulk - 1.0 / 3.0) * (u - w) * (thick - thinned) - at_once * u * thick
        of_terms = 0.0
        for i in range(shares.size):
            z, q = dashpots[i, 0, j], across_dashpots[i, 0, j]
            product = z * dashpots[i, 1, j] + q * across_dashpots[i, 1, j]
            product -= (z - q) * (dashpots[i, 2, j] - across_dashpots[i, 1, j]) / 3.0
            of_terms += shares[i] * product
        total += of_terms
    return 0.5 * total - whole + 0.5 * elastic, moved, total


@numba.njit(cache=True, nogil=True)
def _follow(shares, decay, end, start, given0, dashpots0, strains, dashpots, relaxed):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Fill in the dashpots at the end of a step, and the sum of s_i of them; by rows, which the compiler vectorises."""
    relaxed[:] = 0.0
    for i in range(shares.size):
        share, at_end, at_start, decay_of_term = shares[i], end[i], start[i], decay[i]
        for k in range(strains.shape[0]):
            for j in range(strains.shape[1]):
                value = at_end * strains[k, j] + at_start * given0[k, j] + decay_of_term * dashpots0[i, k, j]
                dashpots[i, k, j] = value
                relaxed[k, j] += share * value
