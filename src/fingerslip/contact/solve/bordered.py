"""Pieces of the contact problem in the plane that differ in a few nodes from a base whose matrix is factorised.

A piece (:mod:`fingerslip.contact.solve.pieces`) is a state of every node. Its forces are found from the factors of the
base, with the matrix A_0 and the unknowns x of that, by one more unknown and one more equation, a *border*, for every
component of a node in which both differ ::

    A_0 x + C y = -q,    L(x, y) = 0    or    x = x_0 - Z y,    Z = A_0^-1 C

Where the base has the component among its unknowns, y is what its equation lacks, and L says what the component is:
zero where the node is open, slope times normal force where it slips. Where the base has not, y is a force that comes to
it, and L is the component's own equation, or its share of the normal force. A border without a task has y = 0: it
stays, for a node that changes its state will do so again.
"""

from __future__ import annotations

import numba
import numpy as np

from fingerslip.contact.solve.dense import solve_by_factors
from fingerslip.contact.states import OPEN, SLIP, STICK

__all__ = ["add_borders", "missing_borders", "piece_matrix", "solve_with_borders"]


@numba.njit(cache=True, nogil=True)
def piece_matrix(compliance, states, slopes):  # type: ignore[no-untyped-def]
    """Return the matrix of a piece (n, n) [m/N], its unknowns among the components of all nodes, and their places.

    Arrays: compliance (n_c * 2, n_c * 2) [m/N]; states, slopes (n_c,); returns matrix (n, n) [m/N]; unknowns (n,);
    places (n_c * 2,).
    """
    unknowns, places = np.empty(2 * states.size, dtype=np.int64), np.full(2 * states.size, -1)
    size = 0
    for i in range(states.size):
        for k in range(2 if states[i] == STICK else 1 if states[i] != OPEN else 0):
            unknowns[size], places[2 * i + k] = 2 * i + k, size
            size += 1
    unknowns = unknowns[:size].copy()
    matrix = np.empty((size, size))
    for a in range(size):
        _fill_row(compliance[unknowns[a]], slopes, unknowns, matrix[a])
    return matrix, unknowns, places


@numba.njit(cache=True, nogil=True)
def _fill_row(of_component, slopes, unknowns, row):  # type: ignore[no-untyped-def]
    """Fill in a component's displacement per unknown (n,): tangential forces of nodes that slip follow normal ones."""
    for b in range(unknowns.size):
        row[b] = of_component[unknowns[b]]
        if slopes[unknowns[b] // 2] != 0.0:
            row[b] += slopes[unknowns[b] // 2] * of_component[unknowns[b] + 1]


@numba.njit(cache=True, nogil=True)
def missing_borders(base_states, base_slopes, components, states, slopes):  # type: ignore[no-untyped-def]
    """Return the components (k,) in which a piece differs from its base and which have no border yet, `components`."""
    has = np.zeros(2 * states.size, dtype=np.bool_)
    has[components] = True
    missing = np.empty(2 * states.size, dtype=np.int64)
    size = 0
    for i in range(states.size):
        if states[i] == base_states[i] and slopes[i] == base_slopes[i]:
            continue
        first = 1 if base_states[i] != OPEN and states[i] != OPEN else 0
        last = 0 if base_states[i] == SLIP and states[i] == OPEN else 1
        for k in range(first, last + 1):
            if not has[2 * i + k]:
                missing[size] = 2 * i + k
                size += 1
    return missing[:size].copy()


@numba.njit(cache=True, nogil=True)
def add_borders(compliance, base, components, borders, missing):  # type: ignore[no-untyped-def]
    """Return components (r,) and borders (2, r, n) with those of further components.

    Arrays: compliance (n_c * 2, n_c * 2) [m/N]; components (r,); borders (2, r, n); missing (k,).
    """
    _, base_slopes, unknowns, places, factors, pivots = base
    count = components.size
    bordered, added = np.concatenate((components, missing)), np.zeros((2, count + missing.size, unknowns.size))
    added[:, :count] = borders
    for a in range(count, bordered.size):
        column, of_component = added[0, a], compliance[bordered[a]]
        if places[bordered[a]] >= 0:
            column[places[bordered[a]]] = of_component[bordered[a]]
        else:
            for k in range(unknowns.size):
                column[k] = of_component[unknowns[k]]
            _fill_row(of_component, base_slopes, unknowns, added[1, a])
            added[1, a] /= of_component[bordered[a]]
        solve_by_factors(factors, pivots, column)
    return bordered, added


@numba.njit(cache=True, nogil=True)
def solve_with_borders(compliance, free, base, start, components, borders, states, slopes):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return the forces of a piece, shape (n_c, 2) [N].

    Arrays: compliance (n_c * 2, n_c * 2) [m/N]; free (n_c, 2) [m]; start (n,) [N]; states, slopes (n_c,).
    """
    base_states, base_slopes, unknowns, places, _, _ = base
    right = start.copy()
    matrix, further = _border_equations(compliance, free, base, start, components, borders, states, slopes)
    _eliminate(matrix, further)
    forces = np.zeros_like(free)
    for a in range(components.size):
        right -= further[a] * borders[0, a]
    for k in range(unknowns.size):
        forces[unknowns[k] // 2, unknowns[k] % 2] = right[k]
    for i in range(len(forces)):
        if base_states[i] == SLIP:
            forces[i, 1] += base_slopes[i] * forces[i, 0]
    for a in range(components.size):
        if places[components[a]] < 0:
            forces[components[a] // 2, components[a] % 2] += further[a]
    for i in range(len(forces)):
        # What the borders leave of these is rounding.
        if states[i] == OPEN:
            forces[i] = 0.0
        elif states[i] == SLIP:
            forces[i, 1] = slopes[i] * forces[i, 0]
    return forces


@numba.njit(cache=True, nogil=True)
def _border_equations(compliance, free, base, start, components, borders, states, slopes):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return the equations of the borders: their matrix (r, r) and right-hand side (r,)."""
    base_states, base_slopes, _, places, _, _ = base
    columns, count = borders[0], components.size
    matrix, right = np.zeros((count, count)), np.zeros(count)
    for a in range(count):
        node, is_tangential = components[a] // 2, components[a] % 2 == 1
        row, of_normal = places[components[a]], places[components[a] - 1] if is_tangential else 0
        is_open, slides = states[node] == OPEN, is_tangential and states[node] == SLIP
        if row >= 0 and (is_open or slides):
            # An unknown of the base that is zero, or follows the normal force.
            slope = slopes[node] if slides else 0.0
            matrix[a] = columns[:, row] - slope * columns[:, of_normal]
            right[a] = start[row] - slope * start[of_normal]
        elif row >= 0 or is_open:
            matrix[a, a] = 1.0
        elif not slides:
            right[a] = _own_equation(compliance, free, start, components, borders, places, a, matrix[a])
        else:
            # A tangential force that follows the normal one: in the base with another slope, or not at all.
            matrix[a, a] = 1.0
            if base_states[node] == SLIP:
                change = slopes[node] - base_slopes[node]
                matrix[a] += change * columns[:, of_normal]
                right[a] = change * start[of_normal]
            else:
                matrix[a] -= slopes[node] * (components == components[a] - 1)
    return matrix, right


@numba.njit(cache=True, nogil=True)
def _own_equation(compliance, free, start, components, borders, places, a, row):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Fill in the equation (r,) of the component of a border, over its compliance; return its right-hand side."""
    component = components[a]
    diagonal = compliance[component, component]
    for b in range(components.size):
        row[b] = borders[1, a] @ borders[0, b]
        if places[components[b]] < 0:
            row[b] -= compliance[component, components[b]] / diagonal
    return borders[1, a] @ start + free[component // 2, component % 2] / diagonal


@numba.njit(cache=True, nogil=True)
def _eliminate(matrix, right):  # type: ignore[no-untyped-def]
    """Replace a right-hand side (r,) by the solution for a small matrix (r, r), which is destroyed."""
    count = right.size
    for a in range(count):
        pivot = a
        for b in range(a + 1, count):
            if np.abs(matrix[b, a]) > np.abs(matrix[pivot, a]):
                pivot = b
        if pivot != a:
            for k in range(a, count):
                matrix[a, k], matrix[pivot, k] = matrix[pivot, k], matrix[a, k]
            right[a], right[pivot] = right[pivot], right[a]
        # The solution is checked: what is singular may give anything.
        diagonal = matrix[a, a] if matrix[a, a] != 0.0 else 1.0
        for b in range(a + 1, count):
            share = matrix[b, a] / diagonal
            for k in range(a + 1, count):
                matrix[b, k] -= share * matrix[a, k]
            right[b] -= share * right[a]
    for a in range(count - 1, -1, -1):
        for k in range(a + 1, count):
            right[a] -= matrix[a, k] * right[k]
        right[a] /= matrix[a, a] if matrix[a, a] != 0.0 else 1.0
