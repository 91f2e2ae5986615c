"""The materials of files of FEBio, as laws that exist here."""

from __future__ import annotations

import contextlib
import dataclasses
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any
from xml.etree import ElementTree as ET

from fingerslip.errors import InputError, MeshError, shorten
from fingerslip.materials.choice import AnyMaterial
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.mooney_rivlin import MooneyRivlin
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden
from fingerslip.mesh.decks.febio import LINE, chosen_unit, read_content
from fingerslip.parameters import as_mapping, from_mapping
from fingerslip.parameters.yaml_text import to_text
from fingerslip.units import LengthUnit, metres

# Densities of soft matter and of bone [kg/m^3]: others are left as the program's default, in models without inertia.
_DENSITIES, _USUAL = (100.0, 20000.0), 1000.0
_SOFTEST = 10.0  # of materials that are meant [Pa]
_SHOWN = frozenset({"law", "youngs_modulus", "poisson_ratio", "c10", "c01", "bulk_modulus", "terms"})
_YOUNG = MappingProxyType({"neo-Hookean": NeoHookean, "isotropic elastic": Elastic})


def read_materials(path: str | Path, unit: LengthUnit | None = None) -> dict[str, AnyMaterial]:
    '''Read the materials of a file of FEBio, region by region, where the law exists here.

    These are `neo-Hookean`, `incomp neo-Hookean`, `Mooney-Rivlin`, `Ogden`, `isotropic elastic` (which is small strain
    here) and `uncoupled viscoelastic` around one of the second to fourth. Where the file names no system of units,
    moduli are in newtons per square of the unit of length. A density that cannot be one of tissue is taken as 1000
    kg/m^3.

    Parameters
    ----------
    path : str or Path
        The file.
    unit : {'m', 'cm', 'mm', 'um'}, optional
        Unit of its lengths, where the file names no system of units; without it metres.

    Returns
    -------
    dict of str to Elastic, NeoHookean, MooneyRivlin or Ogden
        The materials by the names of regions; regions of other materials are not there.

    Raises
    ------
    MeshError
        Where the file is no file of FEBio, or names units that FEBio does not have or that are not those given.

    Examples
    --------
    >>> import tempfile
    >>> import fingerslip as fs
    >>> text = """<febio_spec version="4.0">
    ... <Material><material id="1" name="gel" type="neo-Hookean"><E>0.05</E><v>0.45</v></material></Material>
    ... <Mesh><Elements type="hex8" name="pad"/></Mesh>
    ... <MeshDomains><SolidDomain name="pad" mat="gel"/></MeshDomains></febio_spec>"""
    >>> with tempfile.NamedTemporaryFile("w", suffix=".feb") as file:
    ...     _ = file.write(text), file.flush()
    ...     fs.read_materials(file.name, "mm")["pad"].youngs_modulus
    50000.0
    '''
    materials = file_materials(Path(path), unit)
    if materials.doubtful:
        regions = ", ".join(materials.doubtful)
        warnings.warn(
            f"{path}: names no units, and in metres moduli or densities of {regions} are none of a tissue: "
            "give the unit of its lengths, such as unit='mm'",
            UserWarning,
            stacklevel=2,
        )
    return materials.laws


@dataclass(frozen=True)
class FileMaterials:
    """The materials of a file of FEBio."""

    laws: dict[str, AnyMaterial]  # by regions
    refused: tuple[str, ...]  # in words those that have no law here
    assumed: tuple[str, ...]  # in words what the file does not say
    doubtful: tuple[str, ...]  # regions whose numbers show that a file without a unit is in another than metres


def file_materials(file: Path, given: LengthUnit | None) -> FileMaterials:
    """Read the materials of a file of FEBio, with what of them is left out and what is assumed."""
    if not file.is_file() or file.suffix.lower() != ".feb":
        fault = "is no file of FEBio" if file.is_file() else "no such file"
        raise MeshError(str(file), fault, "needs a file that ends in .feb")
    laws: dict[str, AnyMaterial] = {}
    refused, unweighed, doubtful = [], [], []
    content = read_content(file)
    materials = content.root.findall("Material/material")
    tags = {tag.get(key): tag for tag in materials for key in ("id", "name") if tag.get(key)}
    domains = {tag.get("name"): tag.get("mat") for tag in content.root.iterfind("MeshDomains/*")}
    said, force = content.units
    unit = chosen_unit(file, said, given)
    pressure, density = force / metres(unit) ** 2, force / metres(unit) ** 4
    for region, blocks in content.parts().items():
        names = (domains.get(region), blocks[0].get("mat"))
        tag = next((tags[name] for name in names if name in tags), None)
        try:
            laws[region] = _law(ET.Element("") if tag is None else tag, pressure, density)
        except InputError as error:
            kind = "none" if tag is None else tag.get("type", "of no type")
            refused.append(f"the material of {region} ({kind}: {error.found})")
            continue
        written = 0.0 if tag is None else density * _number(tag, "density", 0.0)
        if tag is not None and not _is_of_tissue(written):
            unweighed.append(region)
        if said is None and given is None and (laws[region].stiffness < _SOFTEST or 0.0 < written < _DENSITIES[0]):
            doubtful.append(region)
    with_cells = {*domains.values(), *(tag.get("mat") for tag in content.mesh.iterfind("Elements"))} - {None}
    refused += [
        f"the material {tag.get('name') or tag.get('id', 'of no name')} ({tag.get('type', 'of no type')}), "
        "which no cells have"
        for tag in materials
        if not with_cells & {tag.get("id"), tag.get("name")}
    ]
    assumed = [f"the file names no units, so moduli are taken in N/{unit}^2"] if said is None and laws else []
    if unweighed:
        assumed.append(f"{_USUAL:g} kg/m^3 for {', '.join(unweighed)}, whose density is none of a tissue")
    return FileMaterials(laws, tuple(refused), tuple(assumed), tuple(doubtful))


def _is_of_tissue(density: float) -> bool:
    return _DENSITIES[0] <= density <= _DENSITIES[1]


def study_lines(laws: Mapping[str, Any]) -> list[str]:
    """Return the lines in which a study file gives regions their laws; what a law has by itself is left out."""
    lines = []
    for region, law in laws.items():
        defaults = {field.name: field.default for field in dataclasses.fields(law)}
        values = {key: text for key, text in as_mapping(law).items() if getattr(law, key) != defaults[key]}
        lines += to_text({region: {"law": law.law, **values}}).splitlines()
    return lines


def _law(tag: ET.Element, pressure: float, density: float) -> AnyMaterial:
    """Return the law of a material, whose units of modulus [Pa] and of density [kg/m^3] are these."""
    if tag.get("type") == "viscoelastic":
        raise InputError(
            "", f"relaxes in volume, too, as no law here does{_at_rest(tag, pressure)}", "needs another law"
        )
    mass = density * _number(tag, "density", 0.0)
    values: dict[str, Any] = {"density": f"{mass if _is_of_tissue(mass) else _USUAL:.12g} kg/m^3"}
    inner, shape = tag, pressure
    if tag.get("type") == "uncoupled viscoelastic":
        # Moduli there are those after a long time, here those at once.
        terms = _terms(tag, "g", "t")
        total = _number(tag, "g0", 1.0) + sum(share for share, _ in terms)
        if not total > 0.0:
            raise InputError("", f"with shares that add up to {total:g}", "needs more than 0")
        values["prony"] = [{"share": share / total, "time": f"{time!r} s"} for share, time in terms]
        elastic = tag.find("elastic")
        inner, shape = tag if elastic is None else elastic, total * pressure
    kind = inner.get("type", "")
    if kind in _YOUNG and inner is tag:
        values["youngs_modulus"] = f"{shape * _number(tag, 'E'):.12g} Pa"
        return from_mapping(_YOUNG[kind], values | {"poisson_ratio": _number(tag, "v")})
    volumes = {(inner.findtext("pressure_model") or "default").strip(), (tag.findtext("pressure_model") or "0").strip()}
    if kind not in {"Mooney-Rivlin", "incomp neo-Hookean", "Ogden"} or not volumes <= {"default", "0"}:
        raise InputError("", "has no law here", "needs one that read_materials names")
    # The bulk modulus does not relax.
    values["bulk_modulus"] = f"{pressure * _number(tag if tag.find('k') is not None else inner, 'k'):.12g} Pa"
    if kind == "Ogden":
        powers = _terms(inner, "c", "m")
        values["terms"] = [{"modulus": f"{shape * c / (m or 1.0):.12g} Pa", "exponent": m} for c, m in powers]
        return from_mapping(Ogden, values)
    if kind == "Mooney-Rivlin":
        constants = {"c10": _number(inner, "c1"), "c01": _number(inner, "c2", 0.0)}
    else:
        constants = {"c10": 0.5 * _number(inner, "G")}
    return from_mapping(MooneyRivlin, values | {name: f"{shape * value:.12g} Pa" for name, value in constants.items()})


def _at_rest(tag: ET.Element, pressure: float) -> str:
    """Say which law the elastic part of a viscoelastic material has; nothing where there is none."""
    elastic = tag.find("elastic")
    with contextlib.suppress(InputError):
        if elastic is not None:
            values = as_mapping(_law(elastic, pressure, 0.0))
            return f"; at rest {', '.join(f'{key} {values[key]}' for key in values if key in _SHOWN)}"
    return ""


def _terms(tag: ET.Element, first: str, second: str) -> list[tuple[float, float]]:
    """Return the pairs of numbered constants whose first is not zero."""
    numbers = [term for term in range(1, 7) if _number(tag, f"{first}{term}", 0.0)]
    return [(_number(tag, f"{first}{term}"), _number(tag, f"{second}{term}")) for term in numbers]


def _number(tag: ET.Element, name: str, default: float | None = None) -> float:
    """Return a constant of a material."""
    constant = tag.find(name)
    if constant is None and default is not None:
        return default
    text = "" if constant is None else constant.text or ""
    # Constants may follow a map, a load curve or a formula.
    with contextlib.suppress(ValueError):
        if constant is not None and constant.keys() == [LINE]:
            return float(text)
    raise InputError(
        "", f"without a number {name}" if constant is None else f"with {name} '{shorten(text)}'", "needs a number"
    )
