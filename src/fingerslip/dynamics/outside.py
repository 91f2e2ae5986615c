"""The check that no boundary node outside the candidates reaches its counterface."""

from __future__ import annotations

import numpy as np

from fingerslip.contact.candidates import check_outsiders
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.system import System

__all__ = ["OutsideCheck"]


class OutsideCheck:
    """Looks at every state of a motion, at several at once: each look costs, whatever it looks at.

    Parameters
    ----------
    system : System
        The discrete system.
    """

    def __init__(self, system: System) -> None:
        self._system = system
        self._waiting: list[State] = []

    def look(self, state: State) -> None:
        """Check a state, now or with some that follow.

        Raises
        ------
        SlipOutsideContactError
            Where a node that is no candidate has reached its counterface.
        """
        self._waiting.append(state)
        if len(self._waiting) >= self._system.coordinates.checks_at_once:
            self.finish()

    def finish(self) -> None:
        """Check the states that wait; errors as of :meth:`look`."""
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return
        for number, outsiders in enumerate(self._system.outsiders):
            size, known = outsiders.relative.shape[1], outsiders.positions
            moved = (outsiders.relative @ np.stack([state.displacement[:size] for state in waiting], axis=1)).T
            counterface = np.stack([state.counterfaces[number] for state in waiting])
            points = known + moved.reshape(len(waiting), *known.shape) - counterface[:, None]
            gaps = self._system.counterfaces.shapes[number].gap(points.reshape(-1, known.shape[1]))
            for state, own in zip(waiting, gaps.reshape(len(waiting), len(known)), strict=True):
                check_outsiders(own, outsiders.nodes, known, state.time)
