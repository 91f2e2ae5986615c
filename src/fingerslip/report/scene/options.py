"""What a scene shows, as data: loading it loads nothing that draws."""

from __future__ import annotations

from collections.abc import Mapping

from fingerslip.parameters import parameters
from fingerslip.report.scene.names import Camera, Cut, Scalar

__all__ = ["SCALARS", "SceneOptions"]

#: Fields that can be shown: their title, and the factor from SI to its unit.
SCALARS: Mapping[str, tuple[str, float]] = {
    "von_mises": ("von Mises stress [kPa]", 1e-3),
    "strain_energy_density": ("strain energy density [J/m³]", 1.0),
    "displacement": ("displacement [mm]", 1e3),
    "velocity": ("velocity [mm/s]", 1e3),
    "region": ("region", 1.0),
}


@parameters
class SceneOptions:
    """What a scene shows.

    Parameters
    ----------
    scalar : {'von_mises', 'strain_energy_density', 'displacement', 'velocity', 'region'}
        The field that colours the layers.
    hidden : tuple of str
        Regions that are left out.
    cut : {'none', 'x', 'y', 'z'}
        Normal of a plane through the middle of the body, in front of which everything is left out.
    camera : {'oblique', 'side', 'front', 'below'}
        Direction of view; from below the contact is seen through the plate. Two-dimensional results are seen from the
        side.
    plate, receptors, edges : bool
        Whether the outline of the plate, recorded sites and the edges of the cells are drawn.
    contact : bool
        Whether the nodes that touch are drawn, in the colours of stick and slip.
    written : bool
        Whether the time and the colour bar are written into the picture.
    """

    scalar: Scalar = "von_mises"
    hidden: tuple[str, ...] = ()
    cut: Cut = "none"
    camera: Camera = "oblique"
    plate: bool = True
    receptors: bool = True
    edges: bool = False
    contact: bool = False
    written: bool = True
