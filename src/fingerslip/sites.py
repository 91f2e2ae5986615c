"""Sites: points whose signals a simulation records. Data only; no mesh is needed to name one."""

from __future__ import annotations

from typing import Literal, get_args

from fingerslip.parameters import Length, parameters

#: The four types of mechanoreceptors in the skin of the fingertip.
ReceptorKind = Literal["FA-I", "SA-I", "FA-II", "SA-II"]
RECEPTOR_KINDS: tuple[str, ...] = get_args(ReceptorKind)


@parameters
class Site:
    """A point of a body whose signals are recorded.

    Parameters
    ----------
    name : str
        Name in results, such as ``FA-I-07``.
    kind : str
        Receptor type, or any word for a site of one's own.
    position : tuple of float
        Coordinates x, y and in 3D z [m].
    region : str, optional
        Region on whose side of an interface stresses are taken; any where not given.
    """

    name: str
    kind: str
    position: tuple[Length, ...]
    region: str | None = None
