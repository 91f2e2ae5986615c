"""Which specimen a study names, and that every one of them answers the protocol."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import pytest

from fingerslip.errors import InputError
from fingerslip.mesh.source import MeshFile
from fingerslip.parameters import parameters
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.specimens import choice
from fingerslip.specimens.choice import (
    SPECIMENS,
    SpecimenChoice,
    check_mesh,
    given_specimen,
    preset_names,
    presets_of,
    specimen_mesh_sources,
)
from fingerslip.specimens.fingertip.fingertip import Fingertip, MeshSizes, SolidSizes, preset
from fingerslip.specimens.gel_pad.gel_pad import MARKERS
from fingerslip.specimens.protocol import Specimen
from fingerslip.specimens.tactip.numbers import GROUPS

FINGER = {"preset": "wang2014-2d"}


@parameters
class WithSensor(SpecimenChoice):
    """A choice with a second kind of specimen."""

    sensor: Mapping[str, Any] | None = dataclasses.field(default=None, kw_only=True)


def test_the_key_that_is_given_names_the_kind_and_two_are_refused(monkeypatch):
    assert set(SpecimenChoice.__dataclass_fields__) == set(SPECIMENS)
    empty, chosen = SpecimenChoice(), SpecimenChoice(fingertip=FINGER)
    assert (empty.specimen_kind, empty.specimen("x.yaml")) == (None, None)
    assert (chosen.specimen_kind, chosen.specimen("x.yaml")) == ("fingertip", preset("wang2014-2d"))
    with pytest.raises(InputError, match=r"^SpecimenChoice\.fingertip\.preset: 'nobody' is not known"):
        SpecimenChoice(fingertip={"preset": "nobody"})
    monkeypatch.setattr(choice, "SPECIMENS", {**SPECIMENS, "sensor": SPECIMENS["fingertip"]})
    assert given_specimen({**dict.fromkeys(SPECIMENS), "sensor": None}) is None
    assert given_specimen({**dict.fromkeys(SPECIMENS), "sensor": FINGER}) == "sensor"
    assert WithSensor(sensor=FINGER).specimen_kind == "sensor"
    with pytest.raises(InputError, match="sensor: is given with fingertip, needs one of the two"):
        given_specimen({**dict.fromkeys(SPECIMENS), "fingertip": FINGER, "sensor": FINGER})


def test_a_mesh_has_to_suit_the_specimen(monkeypatch):
    check_mesh("fingertip", MeshSizes())
    check_mesh(None, MeshFile("a.msh"))
    with pytest.raises(InputError, match=r"^fingertip or tactip or gel_pad: is missing, needs a preset, or mesh.file"):
        check_mesh(None, MeshSizes())
    monkeypatch.setattr(Fingertip, "mesh_sources", (SolidSizes,))
    with pytest.raises(InputError, match="mesh: does not mesh a fingertip"):
        check_mesh("fingertip", MeshSizes())


def test_presets_and_mesh_sources_of_all_kinds_are_found_by_names_of_their_own():
    tips = tuple(f"tactip-{skin}-{dim}d" for skin in ("ridged", "smooth") for dim in (2, 3))
    assert preset_names() == ("wang2014-2d", "wang2014-3d", *tips, "gelsight-mini-2d", "gelsight-mini-3d")
    assert presets_of("wang2014-3d").read("wang2014-3d") == preset("wang2014-3d")
    with pytest.raises(InputError, match="preset: 'nobody' is not known, needs one of wang2014-2d, wang2014-3d"):
        presets_of("nobody")
    sources = [source.__name__ for source in specimen_mesh_sources()]
    assert sources == ["MeshSizes", "SolidSizes", "SensorSectionSizes", "SensorSolidSizes", "PadSizes"]


PRESETS = [(kind, name) for kind, presets in SPECIMENS.items() for name in presets.names]
SITES = {"fingertip": RECEPTOR_KINDS, "tactip": tuple(GROUPS), "gel_pad": (MARKERS,)}


@pytest.mark.parametrize(("kind", "name"), PRESETS, ids=[name for _, name in PRESETS])
def test_a_model_can_be_made_of_every_preset(kind, name):
    specimen: Specimen = SPECIMENS[kind].read(name)
    assert dataclasses.is_dataclass(specimen)
    assert type(specimen.default_mesh) in specimen.mesh_sources
    assert specimen.formulation in ("plane_strain", "plane_stress")
    assert specimen.depth > 0 < specimen.largest_extent < 1
    assert specimen.materials
    dim = specimen.default_mesh.dim
    assert all(set(axes) <= set("xyz"[:dim]) for axes in specimen.supports(dim).values())
    for site in specimen.sites(SITES[kind], dim):
        assert len(site.position) == dim
        assert site.region in specimen.materials
