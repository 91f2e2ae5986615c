"""Sites: points whose signals a simulation records. Data only; no mesh is needed to name one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Annotated, Literal, get_args

from fingerslip.parameters import Length, parameters

#: The four types of mechanoreceptors in the skin of the fingertip.
ReceptorKind = Literal["FA-I", "SA-I", "FA-II", "SA-II"]
RECEPTOR_KINDS: tuple[str, ...] = get_args(ReceptorKind)


@parameters
class Site:
    """A point of a body whose signals are recorded.

    See :class:`Model`.
    """

    name: Annotated[str, "Name in results, such as ``FA-I-07``."]
    kind: Annotated[str, "Receptor type, or any word for a site of one's own."]
    position: Annotated[tuple[Length, ...], "Coordinates x, y and in 3D z [m]."]
    region: Annotated[str | None, "Region on whose side of an interface stresses are taken; any where not given."] = (
        None
    )


def ring_sites(kind: str, rings: Iterable[int], points: Iterable[Iterable[float]], region: str) -> tuple[Site, ...]:
    """Return sites of a kind at points [m], named by ring and their numbers in it: ``internal-marker-2-05``."""
    sites, count = [], Counter[int]()
    for ring, point in zip(rings, points, strict=True):
        count[ring] += 1
        name = f"{kind.replace(' ', '-')}-{ring}-{count[ring]:02d}"
        sites.append(Site(name, kind, tuple(map(float, point)), region))
    return tuple(sites)
