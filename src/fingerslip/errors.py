"""The exceptions of fingerslip: every one says where, what was found, what is allowed and how to repair it."""

from __future__ import annotations

import warnings

__all__ = [
    "ConvergenceError",
    "FingerslipError",
    "InputError",
    "MeshError",
    "ResultError",
    "SlipOutsideContactError",
    "warn_renamed",
]


def warn_renamed(old: str, new: str) -> None:
    """Warn that a public name has a new one; the caller's caller is blamed."""
    warnings.warn(f"'{old}' is now '{new}'; the old name goes with the next version", FutureWarning, stacklevel=3)


class FingerslipError(Exception):
    """Base of all errors that fingerslip raises on purpose."""


class InputError(FingerslipError, ValueError):
    """An input that cannot be used, with its four parts.

    Parameters
    ----------
    where : str
        The place, such as ``studies/x.yaml: contact.friction_coefficient``.
    found : str
        What stands there, such as ``got -0.2``.
    allowed : str
        What may stand there, such as ``needs a number >= 0``.
    repair : str, optional
        What to write instead, where `allowed` does not say it already.
    """

    def __init__(self, where: str, found: str, allowed: str, repair: str = "") -> None:
        self.where, self.found, self.allowed, self.repair = where, found, allowed, repair
        super().__init__(where, found, allowed, repair)

    @property
    def mend(self) -> str:
        """Old name of `repair`."""
        warn_renamed("mend", "repair")
        return self.repair

    def __str__(self) -> str:
        text = f"{self.where}: {self.found}, {self.allowed}"
        return f"{text}; {self.repair}" if self.repair else text


class MeshError(InputError):
    """A mesh that cannot be built, read or computed on."""


class SlipOutsideContactError(InputError):
    """Contact reached a place of the boundary that was not a contact candidate."""


class ConvergenceError(FingerslipError):
    """The frictional contact problem of one time step was not solved.

    Parameters
    ----------
    time : float
        Time of the step [s].
    node : int
        Mesh node with the largest residual.
    residual : float
        Relative residual reached [-].
    tolerance : float
        Relative residual asked for [-].
    advice : str
        What to try.
    """

    def __init__(self, time: float, node: int, residual: float, tolerance: float, advice: str) -> None:
        self.time, self.node, self.residual = time, node, residual
        self.tolerance, self.advice = tolerance, advice
        super().__init__(time, node, residual, tolerance, advice)

    def __str__(self) -> str:
        return (
            f"contact at t = {self.time:.6g} s, node {self.node}: residual {self.residual:.2e}, "
            f"needs <= {self.tolerance:.0e}; {self.advice}"
        )


class ResultError(FingerslipError):
    """A result that cannot be written or read back."""
