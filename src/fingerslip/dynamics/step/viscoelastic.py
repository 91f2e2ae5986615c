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
from fingerslip.materials.viscoelastic import OutOfPlane


@dataclass(frozen=True)
class HistoryVariables:
    """What viscoelastic layers alike remember; the arrays across have a size of 0 where there is no plane stress."""

    given: Floats  # (p, n), displacement u [m] and S u [N], in plane stress also T u [N]
    dashpots: Floats  # (t, p, n), the same of the displacements z_i of t terms
    relaxed: Floats  # (p, n), the same of y = sum s_i z_i
    across: Floats  # (2, n), in plane stress w [m] and T w [N], and the same of its dashpots q_i and of sum s_i q_i
    across_dashpots: Floats  # (2, n) [m]
    across_relaxed: Floats  # (2, n) [m]
    stored: float = 0.0  # by how much the stored energy differs from that of the elastic stiffness [J]
    of_dashpots: float = 0.0  # sum of s_i z_i.D z_i with the stiffness D of the deviator of the strain [J]
    dissipated: float = 0.0  # energy that was dissipated in the last step [J]


@dataclass(frozen=True)
class Viscous:
    """Viscoelastic layers alike, for a fixed step."""

    layers: ViscoelasticLayers  # their matrices, on the unknowns of a system
    recurrence: Recurrence  # how the dashpots follow

    @cached_property
    def share(self) -> float:
        """Share a of the displacement at the end of a step that the dashpots have taken by then [-]."""
        return float(self.recurrence.shares @ self.recurrence.end)

    @cached_property
    def thickness_shares(self) -> tuple[float, float]:
        """Parts in w_1 of u_1, and of the dashpots that the start of the step gives [-]; none but in plane stress."""
        return (0.0, 0.0) if self.layers.across is None else self.layers.across.of_step(self.share)

    @property
    def stiffness(self) -> sparse.csr_matrix:
        """What the force at the end of a step adds to the elastic stiffness, shape (n, n) [N/m]."""
        added = -self.share * self.layers.shape
        if self.layers.across is not None and self.layers.thickness is not None:
            factor = (1.0 - self.share) * self.thickness_shares[0] - self.layers.across.along
            added = added + factor * self.layers.thickness
        return sparse.csr_matrix(added)

    def force(self, variables: HistoryVariables) -> Floats:
        """Return q, by which the force at the end of a step is less than that of its stiffness, shape (n,) [N].

        It is S m + T (mu - share (m + 2 mu)), with what of the dashpots along and across follows from the start.
        """
        along = self._from_start(variables.given, variables.dashpots)
        force: Floats = along[1]
        if self.layers.across is not None:
            across = self._from_start(variables.across, variables.across_dashpots)[1]
            force = force + across - (1.0 - self.share) * self.thickness_shares[1] * (along[2] + 2.0 * across)
        return force

    def after(self, variables: HistoryVariables, displacement: Floats) -> HistoryVariables:
        """Return what is remembered at the end of a step with a displacement u_1 (n,) [m]."""
        if self.layers.across is not None and self.layers.thickness is not None:
            return self._after_in_plane_stress(variables, displacement, self.layers.across, self.layers.thickness)
        given = np.stack([displacement, self.layers.shape @ displacement])
        dashpots, relaxed = self._follow(variables.given, variables.dashpots, given)
        shares = self.recurrence.shares
        of_dashpots = float(shares @ np.vecdot(dashpots[:, 0], dashpots[:, 1]))
        moved = float((variables.given[0] + displacement) @ (relaxed[1] - variables.relaxed[1]))
        stored = 0.5 * of_dashpots - float(displacement @ relaxed[1])
        across = variables.across, variables.across_dashpots, variables.across_relaxed
        dissipated = 0.5 * (moved - (of_dashpots - variables.of_dashpots))
        return HistoryVariables(given, dashpots, relaxed, *across, stored, of_dashpots, dissipated)

    def _after_in_plane_stress(
        self, variables: HistoryVariables, displacement: Floats, law: OutOfPlane, thickness: sparse.csr_matrix
    ) -> HistoryVariables:
        """Return what :meth:`after` does in plane stress.

        The deviator's stiffness D makes u.D u' = u.S u' + w.T w' - (u - w).T (u' - w')/3.
        """
        given = np.stack([displacement, self.layers.shape @ displacement, thickness @ displacement])
        dashpots, relaxed = self._follow(variables.given, variables.dashpots, given)
        # What of the dashpots follows from the start of the step: all but that of the displacement at its end.
        remembered = relaxed[::2] - self.share * given[::2]
        remembered += 2.0 * self._from_start(variables.across, variables.across_dashpots)
        across = self.thickness_shares[0] * given[::2] + self.thickness_shares[1] * remembered
        dashpots_across, relaxed_across = self._follow(variables.across, variables.across_dashpots, across)
        pull, push, apart = relaxed[1], relaxed_across[1], relaxed[2] - relaxed_across[1]
        (u, _, thick), (w, thinned) = given, across
        whole = u @ pull + w @ push - (u - w) @ apart / 3.0
        both, both_across = variables.given[0] + u, variables.across[0] + w
        moved = both @ (pull - variables.relaxed[1]) + both_across @ (push - variables.across_relaxed[1])
        moved -= (both - both_across) @ (apart - variables.relaxed[2] + variables.across_relaxed[1]) / 3.0
        bulk = law.bulk if np.isfinite(law.bulk) else 0.0
        elastic = w @ thinned + (bulk - 1.0 / 3.0) * ((u - w) @ (thick - thinned)) - law.along * (u @ thick)
        of_terms = np.vecdot(dashpots[:, 0], dashpots[:, 1]) + np.vecdot(dashpots_across[:, 0], dashpots_across[:, 1])
        apart_of_terms = dashpots[:, 0] - dashpots_across[:, 0], dashpots[:, 2] - dashpots_across[:, 1]
        of_dashpots = float(self.recurrence.shares @ (of_terms - np.vecdot(*apart_of_terms) / 3.0))
        stored = 0.5 * of_dashpots - whole + 0.5 * elastic
        dissipated = 0.5 * (moved - (of_dashpots - variables.of_dashpots))
        fields = given, dashpots, relaxed, across, dashpots_across, relaxed_across
        return HistoryVariables(*fields, float(stored), of_dashpots, float(dissipated))

    def _from_start(self, given: Floats, dashpots: Floats) -> Floats:
        """Return what of the sum of s_i z_i at the end of a step follows from its start, (p, n)."""
        shares, follow = self.recurrence.shares, self.recurrence
        return np.asarray((shares @ follow.start) * given + np.tensordot(shares * follow.decay, dashpots, 1))

    def _follow(self, given_before: Floats, dashpots_before: Floats, given: Floats) -> tuple[Floats, Floats]:
        """Return the dashpots (t, p, n) at the end of a step, and the sum of s_i of them, (p, n)."""
        follow = self.recurrence
        end, start, decay = (factors[:, None, None] for factors in (follow.end, follow.start, follow.decay))
        dashpots = decay * dashpots_before
        dashpots += end * given
        dashpots += start * given_before
        return dashpots, np.tensordot(follow.shares, dashpots, 1)

    def elastic_force(self, variables: HistoryVariables) -> tuple[Floats, Floats | None]:
        """Return y and, in plane stress, what T is to be multiplied with: the force is K u - S y + T of that."""
        relaxed, law = variables.relaxed[0], self.layers.across
        if law is None:
            return relaxed, None
        return relaxed, variables.across[0] - law.along * variables.given[0] - variables.across_relaxed[0]


def viscous_steps(layers: Sequence[ViscoelasticLayers], step: float) -> tuple[Viscous, ...]:
    """Return the viscoelastic layers, for a step [s] that their model was checked for."""
    return tuple(Viscous(layer, recurrence(layer.prony, step, controlled=True)) for layer in layers)


def relaxed_force(
    rows: Sequence[ViscoelasticLayers], viscous: Sequence[Viscous], history_variables: Sequence[HistoryVariables]
) -> Floats | float:
    """Return by how much forces are less than those of the elastic stiffness, shape (k,) [N]; 0 without layers."""
    total: Floats | float = 0.0
    for row, layer, variables in zip(rows, viscous, history_variables, strict=True):
        relaxed, thinned = layer.elastic_force(variables)
        total = total + row.shape @ relaxed
        if thinned is not None and row.thickness is not None:
            total = total - row.thickness @ thinned
    return total


def variables_at_rest(viscous: Viscous) -> HistoryVariables:
    """Return what layers remember that have never moved."""
    count, size = len(viscous.recurrence.shares), viscous.layers.shape.shape[0]
    rows, thin = (3, 2) if viscous.layers.across is not None else (2, 0)
    strains, across = np.zeros((rows, size)), np.zeros((thin, size))
    return HistoryVariables(
        strains, np.zeros((count, rows, size)), strains, across, np.zeros((count, thin, size)), across
    )
