"""The fingertip as a specimen: its numbers, what a model takes from them, and the published fingertips."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from fingerslip.errors import InputError, did_you_mean
from fingerslip.materials.choice import kept_values
from fingerslip.mesh.source import ContactReach, GradedMesh, MeshSource
from fingerslip.parameters import PositiveLength, as_mapping, parameters
from fingerslip.parameters.presets import Presets, PresetValue
from fingerslip.parameters.schema import require_kind
from fingerslip.sites import RECEPTOR_KINDS, Site
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.sites import receptor_sites, reference_sites, skin_markers, solid_receptor_sites
from fingerslip.specimens.protocol import ModelUse

if TYPE_CHECKING:
    import skfem

_InPlane = Literal["Q4", "T3", "T6"]
_Solid = Literal["T4", "T10"]

# Gmsh and scikit-fem are loaded where a mesh is built: a mesh file of one's own does without them.


@parameters
class MeshSizes(GradedMesh):
    """Element sizes and element type of a section.

    See :func:`build_section`.
    """

    dim: ClassVar[int] = 2

    contact_size: Annotated[PositiveLength, "Size along the skin that can touch [m]."] = 0.12e-3
    bulk_size: Annotated[PositiveLength, "Largest size, far from the contact [m]."] = 0.28e-3
    contact_reach: ContactReach = 2e-3
    element: Annotated[_InPlane, "Bilinear quadrilateral, linear or quadratic triangle."] = "Q4"

    def build(self, specimen: FingertipNumbers, /) -> skfem.Mesh2D:
        """Build the mesh [m]; see :func:`build_section`."""
        from fingerslip.specimens.fingertip.meshing.section import mesh_section

        return mesh_section(specimen, self)

    def estimated_cells(self, specimen: FingertipNumbers, /) -> float:
        """Return about how many cells the mesh will have."""
        from fingerslip.specimens.fingertip.meshing.section import section_cells

        return section_cells(specimen, self)

    def contact_spacing(self, specimen: FingertipNumbers, /) -> float:
        """Return the distance between neighbouring nodes that can touch [m]: ridges have columns at their tips."""
        from fingerslip.specimens.fingertip.meshing.section import contact_spacing

        return contact_spacing(specimen, self)


@parameters
class SolidSizes(GradedMesh):
    """Element sizes and element type of a fingertip in 3D.

    Linear tetrahedra lock near incompressibility, so overall slip comes late on them; quadratic
    ones, the default, do not.
    """

    dim: ClassVar[int] = 3

    element: Annotated[_Solid, "Linear or quadratic tetrahedra."] = "T10"
    contact_size: Annotated[PositiveLength, "Size along the skin that can touch [m]."] = 0.8e-3
    bulk_size: Annotated[PositiveLength, "Largest size, far from the contact [m]."] = 1.3e-3
    contact_reach: ContactReach = 1.5e-3

    def build(self, specimen: FingertipNumbers, /) -> skfem.Mesh3D:
        """Build the mesh [m]; see :func:`build_solid`."""
        from fingerslip.specimens.fingertip.meshing.solid import mesh_solid

        return mesh_solid(specimen, self)

    def estimated_cells(self, specimen: FingertipNumbers, /) -> float:
        """Return about how many tetrahedra the mesh will have."""
        from fingerslip.specimens.fingertip.meshing.solid import solid_cells

        return solid_cells(specimen, self)


_SECTION, _SOLID = MeshSizes(), SolidSizes()


def build_section(
    fingertip: FingertipNumbers,
    *,
    contact_size: float = _SECTION.contact_size,
    bulk_size: float = _SECTION.bulk_size,
    contact_reach: float = _SECTION.contact_reach,
    element: _InPlane = _SECTION.element,
) -> skfem.Mesh2D:
    """Build the mesh of a section, with named regions and boundaries.

    Parameters
    ----------
    fingertip : Fingertip
        What to mesh.
    contact_size, bulk_size, contact_reach, element : optional
        As of :class:`MeshSizes`.

    Returns
    -------
    skfem.MeshQuad1, skfem.MeshTri1 or skfem.MeshTri2
        Mesh [m] with the regions `epidermis`, `dermis`, `tissue` and `phalanx` and the boundaries `skin` (outer
        surface), `pad` (its part at the contact size), `epidermis_dermis`, `dermis_tissue`, `phalanx_surface` (with
        the tissue) and its parts `phalanx_palmar` and `phalanx_dorsal`; in a sagittal section also `base` (proximal
        cut) and, where the phalanx reaches it, its part `phalanx_base`.

    Raises
    ------
    InputError
        Where sizes and fingertip do not fit together.
    MeshError
        Where no mesh of good quality comes out.

    Examples
    --------
    A coarse section, without the ridges that need small cells:

    >>> import fingerslip as fs
    >>> finger = fs.fingertip_from({"preset": "wang2014-2d", "ridges": {"enabled": False}})
    >>> mesh = fs.build_section(finger, contact_size=0.4e-3, bulk_size=1e-3)
    >>> list(mesh.subdomains)
    ['epidermis', 'dermis', 'tissue', 'phalanx']
    """
    require_kind(fingertip, FingertipNumbers, "a fingertip, such as preset('wang2014-2d')", "fingertip")
    return MeshSizes(contact_size, bulk_size, contact_reach, element).build(fingertip)


def build_solid(
    fingertip: FingertipNumbers,
    *,
    contact_size: float = _SOLID.contact_size,
    bulk_size: float = _SOLID.bulk_size,
    contact_reach: float = _SOLID.contact_reach,
    element: _Solid = _SOLID.element,
) -> skfem.Mesh3D:
    """Build the mesh of a fingertip in 3D, with named regions and boundaries.

    Axes: x along the finger towards the tip, y up (a plate comes from below), z across. The lowest point is at x = 0,
    y = -`half_height`; where the finger is level, the plane z = 0 is its sagittal and x = 0 its transverse section.

    Parameters
    ----------
    fingertip : Fingertip
        What to mesh, with its `solid` part.
    contact_size, bulk_size, contact_reach, element : optional
        As of :class:`SolidSizes`.

    Returns
    -------
    skfem.MeshTet1 or skfem.MeshTet2
        Mesh [m] with the regions and boundaries of a sagittal section, see :func:`build_section`; where there is a
        nail, also with the region `nail` and the part `nail` of the skin.

    Raises
    ------
    InputError
        Where sizes and fingertip do not fit together, or the fingertip has only sections.
    MeshError
        Where no mesh of good quality comes out.
    """
    require_kind(fingertip, FingertipNumbers, "a fingertip, such as preset('wang2014-3d')", "fingertip")
    return SolidSizes(element, contact_size, bulk_size, contact_reach).build(fingertip)


#: Group of the reference nodes h1 to h7 and v1 to v7 of a fingertip in 3D.
REFERENCE_NODES = "reference_nodes"

#: Groups of sites that only a fingertip in 3D has.
_IN_3D: Mapping[str, Callable[[FingertipNumbers], tuple[Site, ...]]] = MappingProxyType(
    {REFERENCE_NODES: reference_sites, "external_markers": skin_markers}
)
_OF_NO_EFFECT = frozenset({"materials", "receptors"})
# Groups of values that are lengths and angles of the shape, and those of sections alone.
_SHAPE = ("section", "sagittal", "transverse", "layers", "phalanx", "ridges", "fingerprint", "solid")
_OF_SECTIONS = ("section", "formulation", "depth")
_KIND_OF_DEPTH = {"receptors.sa_ii_height": "SA-II", "receptors.fa_ii_depth": "FA-II"}


@parameters
class Fingertip(FingertipNumbers):
    """Everything that describes one fingertip, and what a model takes from it.

    See :func:`preset` and :func:`fingertip_from`.
    """

    mesh_sources: ClassVar[tuple[type[MeshSource], ...]] = (MeshSizes, SolidSizes)
    largest_extent: ClassVar[float] = 0.2

    @property
    def default_mesh(self) -> MeshSource:
        """The mesh in 3D where the fingertip has a shape in 3D, else that of its section."""
        return MeshSizes() if self.solid is None else SolidSizes()

    @property
    def shape(self) -> Mapping[str, Any]:
        """All values but materials and receptors, which change no mesh."""
        return {name: value for name, value in as_mapping(self).items() if name not in _OF_NO_EFFECT}

    def supports(self, dim: int, /) -> Mapping[str, tuple[str, ...]]:
        """Return what is held in all components: a rigid phalanx as a whole, an elastic one at its back."""
        return {"phalanx" if self.phalanx.rigid else "phalanx_dorsal": tuple("xyz"[:dim])}

    def sites(self, groups: Sequence[str], dim: int, /) -> tuple[Site, ...]:
        """Return the sites of groups: kinds of receptors, and in 3D ``reference_nodes`` and ``external_markers``.

        The latter are the dots on the skin of a finger that is filmed.
        """
        available = (*RECEPTOR_KINDS, *_IN_3D)
        unknown = next((group for group in groups if group not in available), None)
        if unknown is not None:
            allowed = f"needs some of {', '.join(available)}"
            raise InputError("record.groups", f"a fingertip has no '{unknown}'", allowed)
        receptors, others = set(groups) & set(RECEPTOR_KINDS), [group for group in _IN_3D if group in groups]
        if others and dim == 2:
            raise InputError(f"record.{others[0]}", "without a fingertip in 3D", "needs mesh.element T4 or T10")
        candidates: tuple[Site, ...] = ()
        if receptors:
            candidates = solid_receptor_sites(self) if dim == 3 else receptor_sites(self)
        only_3d = [site for group in others for site in _IN_3D[group](self)]
        return (*(site for site in candidates if site.kind in receptors), *only_3d)

    def unused_reason(self, path: str, use: ModelUse, /) -> str:
        """Return why a value, such as ``phalanx.tissue_thickness``, makes no difference to a model; see `ModelUse`."""
        group, _, name = path.partition(".")
        in_2d, variant, kind = use.dim == 2, self.phalanx.variant, _KIND_OF_DEPTH.get(path)
        other = "transverse" if self.section == "sagittal" else "sagittal"
        of_other = path.startswith((f"{other}.", f"phalanx.{other}."))
        senses = not use.groups.isdisjoint(RECEPTOR_KINDS)
        # The phalanx of a section that is the cut x = 0 of a finger is as high as in the sagittal section.
        is_cut = self.solid is not None and other == "sagittal" and variant != "scaled" and ".zone." not in path
        of_phalanx = path.startswith(("phalanx.sagittal.", "phalanx.transverse.", "solid.phalanx."))
        bare = group in ("phalanx", "fingerprint") or path.startswith(("solid.phalanx.", "solid.nail."))
        of_shape = group in _SHAPE and path != "phalanx.rigid"
        of_print = group == "fingerprint" and name != "enabled"
        # Receptors sit at the ridges, also where these are switched off.
        of_ridges = group == "ridges" and name != "enabled" and not (name == "pitch" and senses)
        # In 3D the zone across the finger bounds the fingerprint alone.
        relief = use.meshed and (self.fingerprint.enabled or (self.ridges.enabled and in_2d))
        in_zone = relief or (senses and (in_2d or group != "transverse"))
        reasons = (
            (f"no {kind} receptors are recorded", kind is not None and kind not in use.groups),
            ("the study gives its own supports", path == "phalanx.rigid" and not use.held),
            ("of 2D sections only", not in_2d and (group in _OF_SECTIONS or path == "ridges.enabled")),
            ("of the fingertip in 3D only", in_2d and group == "solid"),
            (f"of the {other} section only", in_2d and of_other and not is_cut),
            ("the mesh comes from a file", not use.meshed and of_shape and (bare or not use.groups)),
            ("not of the scaled phalanx", variant == "scaled" and of_phalanx),
            ("of the scaled phalanx only", variant != "scaled" and path == "phalanx.tissue_thickness"),
            ("of the original phalanx only", variant == "flattened" and ".concavity_" in path),
            ("of the flattened phalanx only", variant == "original" and path == "phalanx.transverse.palmar_level"),
            ("switched off", of_print and not self.fingerprint.enabled),
            ("switched off", of_ridges and in_2d and not self.ridges.enabled),
            ("of 2D sections and receptors only", of_ridges and not in_2d and name == "pitch"),
            ("of 2D sections only", of_ridges and not in_2d),
            ("nothing lies in the zone", name.startswith("zone.") and not in_zone),
        )
        return next((reason for reason, holds in reasons if holds), "")


PRESETS = Presets(Fingertip, "fingerslip.specimens.fingertip", kept_values)


def preset_names() -> tuple[str, ...]:
    """Return the names of all presets.

    Examples
    --------
    >>> import fingerslip as fs
    >>> fs.preset_names()
    ('wang2014-2d', 'wang2014-3d')
    """
    return PRESETS.names


def preset(name: str) -> Fingertip:
    """Return the fingertip of a preset.

    Parameters
    ----------
    name : str
        One of :func:`preset_names`.

    Raises
    ------
    InputError
        Where no preset of a fingertip has that name; the model of a sensor :func:`~fingerslip.study_model` makes.

    Examples
    --------
    >>> import fingerslip as fs
    >>> finger = fs.preset("wang2014-2d")
    >>> f"skin of {1e3 * finger.layers.skin_thickness:g} mm, tissue of {finger.materials['tissue'].youngs_modulus:g} Pa"
    'skin of 1.5 mm, tissue of 34000 Pa'
    """
    if name not in PRESETS.names:
        studies = "other specimens stand in studies: fs.study_model makes their models"
        repair = did_you_mean(name, PRESETS.names) or studies
        raise InputError("preset", f"'{name}' is no fingertip", f"needs one of {', '.join(PRESETS.names)}", repair)
    return PRESETS.read(name)


def preset_table(name: str) -> tuple[PresetValue, ...]:
    """Return every value of a preset with its source, the assumed ones first.

    Parameters
    ----------
    name : str
        One of :func:`preset_names`.

    Examples
    --------
    >>> import fingerslip as fs
    >>> value = fs.preset_table("wang2014-2d")[0]
    >>> f"{value.path}: {value.value}, {value.source}"
    'section: sagittal, assumed'
    """
    return PRESETS.table(name)


def fingertip_from(mapping: Mapping[str, Any], where: str = "") -> Fingertip:
    """Return the fingertip of a study: a preset and what the study changes in it.

    Parameters
    ----------
    mapping : mapping
        Nested plain data as YAML gives it, with the key ``preset``; the other keys override the preset's values.
    where : str, optional
        What errors put first, such as ``studies/x.yaml: fingertip``.

    Raises
    ------
    InputError
        For an unknown preset, or for all unknown keys and values that do not fit.

    Examples
    --------
    A preset with another phalanx and stiffer tissue:

    >>> import fingerslip as fs
    >>> changes = {"phalanx": {"variant": "flattened"}, "materials": {"tissue": {"youngs_modulus": "50 kPa"}}}
    >>> fs.fingertip_from({"preset": "wang2014-2d"} | changes).materials["tissue"].youngs_modulus
    50000.0
    """
    return PRESETS.changed(mapping, where)
