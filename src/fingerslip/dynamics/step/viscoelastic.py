"""What viscoelastic materials remember, and what a step makes of it.

Dashpots follow the displacement node by node (:mod:`fingerslip.materials.prony`), so a step needs the matrices of
:mod:`fingerslip.fe.forms` once: with the displacement u_1 at its end, y_1 = a u_1 + m with a = sum s_i (1 - phi_i)
and m from the start alone. The force at the end is K_step u_1 - q with a constant matrix. Every field is kept together
with the matrices times it, which obey the same recurrence, so that only the products with u_1 are computed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from fingerslip.arrays import Floats
from fingerslip.fe.forms import ViscoelasticLayers
from fingerslip.materials.prony import Recurrence, recurrence


@dataclass(frozen=True)
class HistoryVariables:
    """What viscoelastic layers alike remember: of a field r rows, u [m] and S u [N], in plane stress w, T w and T u."""

    fields: Floats  # (1 + t, r, n), those of the displacement, and of dashpots z_i of t terms, across q_i
    relaxed: Floats  # (r, n), sums of s_i times these
    stored: float = 0.0  # by how much the stored energy differs from that of the elastic stiffness [J]
    of_dashpots: float = 0.0  # sum of s_i z_i.D z_i with the stiffness D of the deviator of the strain [J]
    dissipated: float = 0.0  # energy that was dissipated in the last step [J]


@dataclass(frozen=True)
class Viscous:
    """Viscoelastic layers alike, for a fixed step."""

    layers: ViscoelasticLayers  # their matrices, on the unknowns of a system
    recurrence: Recurrence  # how the dashpots follow

    @cached_property
    def thickness_shares(self) -> tuple[float, float]:
        """Parts in w_1 of u_1, and of the dashpots that the start of the step gives [-]; none but in plane stress."""
        return (0.0, 0.0) if self.layers.across is None else self.layers.across.of_step(self.recurrence.taken_share)

    @property
    def stiffness(self) -> sparse.csr_matrix:
        """What the force at the end of a step adds to the elastic stiffness, shape (n, n) [N/m]."""
        added = -self.recurrence.taken_share * self.layers.shape
        if self.layers.across is not None and self.layers.thickness is not None:
            factor = (1.0 - self.recurrence.taken_share) * self.thickness_shares[0] - self.layers.across.along
            added = added + factor * self.layers.thickness
        return sparse.csr_matrix(added)

    def force(self, variables: HistoryVariables) -> Floats:
        """Return q, by which the force at the end of a step is less than that of its stiffness, shape (n,) [N].

        It is S m + T (mu - share (m + 2 mu)), with what of the dashpots along and across follows from the start.
        """
        left, rest = self.recurrence.left(variables.fields), 1.0 - self.recurrence.taken_share
        force: Floats = left[1]
        if self.layers.across is not None:
            force = force + left[3] - rest * self.thickness_shares[1] * (left[4] + 2.0 * left[3])
        return force

    def after(self, variables: HistoryVariables, displacement: Floats) -> HistoryVariables:
        """Return what is remembered at the end of a step with a displacement u_1 (n,) [m]."""
        field = np.stack([displacement, self.layers.shape @ displacement])
        if self.layers.thickness is not None:
            pair = np.stack([displacement, self.layers.thickness @ displacement])
            left = self.recurrence.left(variables.fields)
            across = self.thickness_shares[0] * pair + self.thickness_shares[1] * (left[[0, 4]] + 2.0 * left[2:4])
            field = np.concatenate([field, across, pair[1:]])
        fields = self.recurrence.follow(variables.fields, field)
        shares = self.recurrence.shares
        relaxed = np.tensordot(shares, fields[1:], 1)
        of_dashpots = float(shares @ np.array([_product(dashpot, dashpot) for dashpot in fields[1:]]))
        stored = 0.5 * of_dashpots - _product(field, relaxed) + 0.5 * self._beside_elastic(field)
        moved = _product(variables.fields[0] + field, relaxed - variables.relaxed)
        dissipated = 0.5 * (moved - (of_dashpots - variables.of_dashpots))
        return HistoryVariables(fields, relaxed, stored, of_dashpots, dissipated)

    def _beside_elastic(self, field: Floats) -> float:
        """Return by how much twice the energy at once differs from that of the elastic stiffness, as w is free [J]."""
        law = self.layers.across
        if law is None:
            return 0.0
        u, _, w, thinned, thick = field
        bulk = law.bulk if np.isfinite(law.bulk) else 0.0
        return float(w @ thinned + (bulk - 1.0 / 3.0) * ((u - w) @ (thick - thinned)) - law.along * (u @ thick))


def _product(field: Floats, other: Floats) -> float:
    """Return the product u.D u' of two fields (r, n) [J], in plane stress u.S u' + w.T w' - (u - w).T (u' - w')/3."""
    product = field[0] @ other[1]
    if len(field) > 2:
        product += field[2] @ other[3] - (field[0] - field[2]) @ (other[4] - other[3]) / 3.0
    return float(product)


def viscous_steps(layers: Sequence[ViscoelasticLayers], step: float) -> tuple[Viscous, ...]:
    """Return the viscoelastic layers, for a step [s] that their model was checked for."""
    return tuple(Viscous(layer, recurrence(layer.prony, step, controlled=True)) for layer in layers)


def relaxed_force(
    rows: Sequence[ViscoelasticLayers], viscous: Sequence[Viscous], history_variables: Sequence[HistoryVariables]
) -> Floats | float:
    """Return by how much forces are less than those of the elastic stiffness, shape (k,) [N]; 0 without layers.

    The force is K u - S y, and in plane stress T times w - c u - sum s_i q_i on top.
    """
    total: Floats | float = 0.0
    for row, layer, variables in zip(rows, viscous, history_variables, strict=True):
        field, relaxed, law = variables.fields[0], variables.relaxed, layer.layers.across
        total = total + row.shape @ relaxed[0]
        if law is not None and row.thickness is not None:
            total = total - row.thickness @ (field[2] - law.along * field[0] - relaxed[2])
    return total


def variables_at_rest(viscous: Viscous) -> HistoryVariables:
    """Return what layers remember that have never moved."""
    nothing = np.zeros((2 if viscous.layers.across is None else 5, viscous.layers.shape.shape[0]))
    return HistoryVariables(np.zeros((1 + len(viscous.recurrence.shares), *nothing.shape)), nothing)
