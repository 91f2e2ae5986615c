"""Which values of a fingertip make no difference to a model of it, and why."""

from __future__ import annotations

from collections.abc import Callable

from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.protocol import ModelUse

__all__ = ["unused_reason"]

# Parts of a fingertip whose values are lengths and angles of its shape.
_SHAPE = ("section", "sagittal", "transverse", "layers", "phalanx", "ridges", "fingerprint", "solid")
_OF_SECTIONS = ("section", "formulation", "depth")
_KIND_OF_DEPTH = {"receptors.sa_ii_height": "SA-II", "receptors.fa_ii_depth": "FA-II"}


def unused_reason(fingertip: FingertipNumbers, path: str, use: ModelUse) -> str:
    """Return why a value of a fingertip makes no difference to a model.

    Parameters
    ----------
    fingertip : FingertipNumbers
        The fingertip.
    path : str
        Dotted path of the value, such as ``phalanx.tissue_thickness``.
    use : ModelUse
        What the model takes from it.

    Returns
    -------
    str
        The reason; empty for a value that the model uses.
    """
    return next((reason for rule in _RULES for reason in (rule(fingertip, path, use),) if reason), "")


def _has_receptors(use: ModelUse) -> bool:
    return not use.groups.isdisjoint(RECEPTOR_KINDS)


_Rule = Callable[[FingertipNumbers, str, ModelUse], str]


def _of_another_model(fingertip: FingertipNumbers, path: str, use: ModelUse) -> str:
    group = path.partition(".")[0]
    if use.dim == 3:
        return "of 2D sections only" if group in _OF_SECTIONS or path == "ridges.enabled" else ""
    other = "transverse" if fingertip.section == "sagittal" else "sagittal"
    if group == "solid":
        return "of the fingertip in 3D only"
    of_other = group == other or path.startswith(f"phalanx.{other}.")
    if of_other and not (_is_cut_of_finger(fingertip) and ".zone." not in path):
        return f"of the {other} section only"
    return ""


def _is_cut_of_finger(fingertip: FingertipNumbers) -> bool:
    """Tell whether the section is the cut x = 0 of a finger; its phalanx is as high as in the sagittal section."""
    across = fingertip.solid is not None and fingertip.section == "transverse"
    return across and fingertip.phalanx.variant != "scaled"


def _of_another_mesh(_fingertip: FingertipNumbers, path: str, use: ModelUse) -> str:
    """Look at a mesh from a file, for which the shape gives the recorded sites at most."""
    group = path.partition(".")[0]
    if use.meshed or group not in _SHAPE or path == "phalanx.rigid":
        return ""
    bare = group in ("phalanx", "fingerprint") or path.startswith(("solid.phalanx.", "solid.nail."))
    return "the mesh comes from a file" if bare or not use.groups else ""


def _of_another_phalanx(fingertip: FingertipNumbers, path: str, _use: ModelUse) -> str:
    variant = fingertip.phalanx.variant
    if variant == "scaled":
        shaped = path.startswith(("phalanx.sagittal.", "phalanx.transverse.", "solid.phalanx."))
        return "not of the scaled phalanx" if shaped else ""
    if path == "phalanx.tissue_thickness":
        return "of the scaled phalanx only"
    if variant == "flattened" and ".concavity_" in path:
        return "of the original phalanx only"
    flattened = path == "phalanx.transverse.palmar_level"
    return "of the flattened phalanx only" if flattened and variant == "original" else ""


def _of_other_supports(_fingertip: FingertipNumbers, path: str, use: ModelUse) -> str:
    return "the study gives its own supports" if path == "phalanx.rigid" and not use.held else ""


def _switched_off(fingertip: FingertipNumbers, path: str, use: ModelUse) -> str:
    """Look at ridges and fingerprint. Receptors sit at the ridges, also where these are switched off."""
    group, _, name = path.partition(".")
    if group == "fingerprint":
        return "switched off" if name != "enabled" and not fingertip.fingerprint.enabled else ""
    if group != "ridges" or name == "enabled" or (name == "pitch" and _has_receptors(use)):
        return ""
    if use.dim == 3:
        return "of 2D sections and receptors only" if name == "pitch" else "of 2D sections only"
    return "" if fingertip.ridges.enabled else "switched off"


def _of_an_empty_zone(fingertip: FingertipNumbers, path: str, use: ModelUse) -> str:
    """Look at the zones: in 3D the one across the finger bounds the fingerprint alone."""
    outline, _, name = path.partition(".")
    if not name.startswith("zone."):
        return ""
    relief = fingertip.fingerprint.enabled or (fingertip.ridges.enabled and use.dim == 2)
    receptors = _has_receptors(use) and not (use.dim == 3 and outline == "transverse")
    return "" if (relief and use.meshed) or receptors else "nothing lies in the zone"


def _recording_reason(_fingertip: FingertipNumbers, path: str, use: ModelUse) -> str:
    kind = _KIND_OF_DEPTH.get(path)
    return f"no {kind} receptors are recorded" if kind and kind not in use.groups else ""


_RULES: tuple[_Rule, ...] = (
    _of_another_model,
    _of_another_mesh,
    _of_another_phalanx,
    _of_other_supports,
    _switched_off,
    _of_an_empty_zone,
    _recording_reason,
)
