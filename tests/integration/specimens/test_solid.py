"""The fingertip in 3D: names, volumes, layers, angles, quality, and the size of the published mesh."""

import dataclasses

import numpy as np
import pytest
import skfem

from fingerslip.errors import FingerslipError, InputError
from fingerslip.fe.space import build_space
from fingerslip.mesh.quality import check_quality, quality_table
from fingerslip.specimens.fingertip.fingertip import SolidSizes, build_solid, preset
from fingerslip.specimens.fingertip.meshing.solid import mesh_solid, solid_cells, sweep_solid_skin
from fingerslip.specimens.fingertip.outline import outline_curve
from fingerslip.specimens.fingertip.phalanx import phalanx_surface
from fingerslip.specimens.fingertip.skin import depth_below_skin
from fingerslip.study.definition.spec import read_study
from places import STUDIES
from unit.fingers import HARD, NAIL, VARIANTS, change_solid, coarse_solid, volumes

COARSE = {"contact_size": 0.8e-3, "bulk_size": 1.6e-3}


def region_of(mesh):
    region = np.empty(mesh.t.shape[1], dtype=int)
    for number, cells in enumerate(mesh.subdomains.values()):
        region[cells] = number
    return region


@pytest.mark.parametrize(
    "variant", [VARIANTS[0], *(pytest.param(name, marks=pytest.mark.slow) for name in VARIANTS[1:])]
)
def test_names_share_out_cells_and_outside(variant):
    mesh = coarse_solid(variant)
    assert list(mesh.subdomains) == ["epidermis", "dermis", "tissue", "phalanx"]
    assert np.array_equal(np.sort(np.concatenate(list(mesh.subdomains.values()))), np.arange(mesh.t.shape[1]))
    outside = np.concatenate([mesh.boundaries["skin"], mesh.boundaries["base"]])
    assert np.array_equal(np.sort(outside), np.sort(mesh.boundary_facets()))
    assert ("phalanx_base" in mesh.boundaries) == (variant != "scaled")
    for name, pair in (("epidermis_dermis", (0, 1)), ("dermis_tissue", (1, 2)), ("phalanx_surface", (2, 3))):
        sides = np.sort(region_of(mesh)[mesh.f2t[:, mesh.boundaries[name]]], axis=0)
        assert np.array_equal(np.unique(sides, axis=1).ravel(), pair)
    check_quality(mesh)


@pytest.mark.slow
def test_volumes_are_those_of_the_surfaces():
    mesh, finger = coarse_solid(), change_solid()
    outline, width = finger.sagittal, finger.transverse.half_width
    pad = np.pi * width * outline.pad_length * (outline.half_height - outline.pad_rise / 6)
    tip = 2 / 3 * np.pi * outline.tip_length * outline.half_height * width
    cells = volumes(mesh)
    assert cells.sum() == pytest.approx(pad + tip, rel=0.01)
    # Coarse meshes have more than fill the body, because layers and contact are finer.
    assert 0.2 * mesh.nelements < solid_cells(finger, SolidSizes("T4", **COARSE)) < mesh.nelements
    depth = depth_below_skin(finger, mesh.p[:, mesh.t].mean(axis=1).T)
    near = {"epidermis": (0.0, 0.5e-3), "dermis": (0.5e-3, 1e-3), "tissue": (1e-3, 9e-3), "phalanx": (1e-3, 9e-3)}
    for name, (least, largest) in near.items():
        inside = depth[mesh.subdomains[name]]
        assert least - 6e-5 < inside.min() < inside.max() < largest + 6e-5


def test_skin_in_the_middle_plane_is_the_sagittal_outline():
    mesh = coarse_solid()
    nodes = np.unique(mesh.facets[:, mesh.boundaries["skin"]])
    middle = mesh.p[:, nodes[mesh.p[2, nodes] == 0.0]].T
    assert len(middle) > 30
    curve = outline_curve(dataclasses.replace(change_solid(), section="sagittal"))
    gap = np.linalg.norm(curve.points[None] - middle[:, None, :2], axis=2).min(axis=1)
    assert gap.max() < 6e-6


@pytest.mark.slow
def test_quadratic_mesh_has_the_names_and_the_shape_of_the_linear_one():
    linear, quadratic = coarse_solid(), build_solid(change_solid(), **COARSE, element="T10")
    # The same input gives the same mesh.
    assert np.allclose(quadratic.p[:, : linear.p.shape[1]], linear.p, rtol=0, atol=1e-15)
    assert type(quadratic) is skfem.MeshTet2
    assert build_space(quadratic).element == "T10"
    assert np.array_equal(quadratic.t, linear.t)
    assert {n: len(f) for n, f in quadratic.boundaries.items()} == {n: len(f) for n, f in linear.boundaries.items()}
    assert quadratic.doflocs.shape[1] > 6 * linear.p.shape[1]


@pytest.mark.slow
def test_finger_at_an_angle_with_a_nail():
    thin = {**NAIL, "thickness": "0.3 mm"}
    finger = change_solid(solid={"angle": "0.35 rad", "nail": thin}, materials={"nail": HARD})
    mesh = build_solid(finger, **COARSE, element="T4")
    assert list(mesh.subdomains)[-1] == "nail"
    assert set(mesh.subdomains) == set(finger.materials)
    lowest = mesh.p[:, mesh.p[1].argmin()]
    assert lowest == pytest.approx([0.0, -6.5e-3, 0.0], abs=6e-4)
    assert lowest[1] == pytest.approx(-6.5e-3, abs=2e-5)
    edges = np.diff(mesh.p[:, mesh.facets[:, mesh.boundaries["nail"]]], axis=1).transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(*edges, axis=0), axis=0).sum() / 2
    assert area == pytest.approx(9e-3 * 11e-3, rel=0.25)
    assert volumes(mesh)[mesh.subdomains["nail"]].sum() / area == pytest.approx(0.3e-3, rel=0.1)
    assert mesh.p[1, mesh.facets[:, mesh.boundaries["nail"]]].min() > 0.0


@pytest.mark.slow
def test_linear_mesh_of_the_replication_has_the_size_of_the_published_one():
    sizes = read_study(STUDIES / "wang2014_3d_tetrahedra.yaml").mesh
    mesh = mesh_solid(preset("wang2014-3d"), sizes)
    assert mesh.t.shape[1] == pytest.approx(130492, rel=0.03)
    assert 22000 < mesh.p.shape[1] < 34000
    for row in quality_table(mesh):
        assert np.degrees([row.smallest_angle, 180 - row.largest_angle]).min() > 8.0


def random_finger(seed):
    """Return a finger of random but plausible dimensions, as in a study file."""
    draw = np.random.default_rng(seed).uniform
    height, skin = draw(5.0, 8.0), draw(0.6, 1.6)
    width = height * draw(1.0, 1.4)

    def mm(value):
        return f"{value:.4f} mm"

    phalanx = {"base_half_width": mm(width * draw(0.4, 0.6)), "waist_half_width": mm(width * draw(0.3, 0.45))}
    phalanx |= {"waist_position": mm(draw(-8, -3)), "end_half_width": mm(width * draw(0.25, 0.45))}
    along = {"palmar_level": mm(-height * draw(0.1, 0.4)), "dorsal_level": mm(height * draw(0.3, 0.5))}
    along |= {"distal_end": mm(draw(2, 5)), "concavity_depth": mm(draw(0, 1.5)), "concavity_position": mm(draw(-8, -2))}
    across = {"half_width": mm(width * draw(0.5, 0.7)), "half_height": mm(height * draw(0.35, 0.5))}
    across |= {"palmar_level": mm(-0.3 * height), "concavity_depth": mm(draw(0, 1.2))}
    return change_solid(
        sagittal={
            "half_height": mm(height), "pad_length": mm(draw(10, 22)), "pad_rise": mm(height * draw(0, 0.8)),
            "tip_length": mm(height * draw(0.9, 1.8))
        },
        transverse={"half_height": mm(height), "half_width": mm(width)},
        layers={"skin_thickness": mm(skin), "epidermis_thickness": mm(skin * draw(0.25, 0.6))},
        phalanx={
            "variant": VARIANTS[seed % 3], "corner_radius": mm(draw(0.1, 0.6)), "tissue_thickness": mm(draw(1.2, 3.5)),
            "sagittal": along, "transverse": across
        },
        solid={"angle": f"{draw(-0.5, 0.5):.3f} rad", "base_half_width": mm(width * draw(0.85, 1.15)),
               "phalanx": phalanx}
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_random_fingers_are_meshed_or_refused_clearly(seed):
    try:
        fingertip = random_finger(seed)
        mesh = build_solid(fingertip, contact_size=0.5e-3, bulk_size=1.2e-3, element="T4")
    except FingerslipError as error:
        # Only a shape whose phalanx or layers do not fit may be refused, not one that the mesher fails on.
        assert isinstance(error, InputError)  # noqa: PT017
        assert type(error) is InputError  # noqa: PT017
        return
    build_space(mesh)
    assert volumes(mesh).min() > 0.0


RIPPLED = change_solid(fingerprint={"enabled": True, "pitch": "0.94 mm"})


@pytest.mark.slow
def test_fingerprint_is_on_the_contact_and_leaves_the_dermis_alone():
    sizes = SolidSizes("T4", contact_size=0.234e-3, bulk_size=1.6e-3, contact_reach=0.12e-3)
    skin = sweep_solid_skin(RIPPLED, sizes, phalanx_surface(RIPPLED).points.reshape(-1, 3))
    depth = depth_below_skin(RIPPLED, skin.points[0])
    low = skin.points[0][:, 1] < -6.5e-3 + 0.09e-3
    assert depth[low].min() == pytest.approx(-0.05e-3, rel=0.1)
    assert depth[low].max() == pytest.approx(0.05e-3, rel=0.1)
    assert np.abs(depth[skin.points[0][:, 1] > -6.3e-3]).max() < 4e-6
    dermis = int(np.abs(skin.levels - 0.5e-3).argmin())
    inside = skin.points[0][:, 0] > -12e-3
    assert np.allclose(depth_below_skin(RIPPLED, skin.points[dermis][inside]), 0.5e-3, atol=1e-5)


SIZES = SolidSizes("T4", contact_size=0.8e-3, bulk_size=1.6e-3)
