"""Fields have closed forms for simple motions, units, and no value where nothing was seen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra.numpy import arrays
from hypothesis.strategies import floats
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from fingerslip.errors import InputError
from fingerslip.marker_layouts import hexagonal_layout, ring_layout
from fingerslip.vision.fields import (
    FIELDS,
    contact_centroid,
    fit_rigid_motions,
    green_strain,
    larger_principal,
    marker_fields,
    marker_means,
    marker_triangles,
    rest_positions,
    smooth_velocity,
    triangle_gradients,
    window_frames,
)
from fingerslip.vision.tracks import make_tracks
from unit.vision.scenes import hide

LAYOUT = ring_layout(1e-3)
TIMES = np.arange(31) / 30


def strains(gradient):
    strain = 0.5 * (gradient + gradient.T + gradient.T @ gradient)
    return strain[[0, 1, 0], [0, 1, 1]]


def moved(gradient, speed=(0.0, 0.0), units="m"):
    """Return markers whose displacement is linear in place and time."""
    shift = np.einsum("ab,mb->ma", np.asarray(gradient, dtype=float), LAYOUT.position) + speed
    position = LAYOUT.position + TIMES[:, None, None] * shift
    return make_tracks(position, TIMES, units=units, ring=LAYOUT.ring, attributes={"frame_rate": 30.0})


def test_every_field_has_its_dimensions_unit_and_meaning():
    fields = marker_fields(moved(np.zeros((2, 2)), units="px"))
    assert set(fields.data_vars) == set(FIELDS)
    for name, (dims, unit, meaning) in FIELDS.items():
        assert fields[name].dims == dims
        assert fields[name].attrs == {"units": unit.replace("length", "px"), "long_name": meaning}
    assert (fields.attrs["frame_rate"], fields.attrs["smoothing"]) == (30.0, 0.2)
    assert "ring" in fields.coords


def test_an_affine_motion_has_its_closed_form_also_in_3d():
    gradient = np.array([[0.05, -0.02], [0.04, 0.03]])
    fields = marker_fields(moved(gradient, (1e-3, -2e-3)))
    np.testing.assert_allclose(fields["divergence"].values[-1], 0.08, atol=1e-12)
    np.testing.assert_allclose(fields["curl"].values[-1], 0.06, atol=1e-12)
    np.testing.assert_allclose(fields["strain"].values[-1], np.tile(strains(gradient), (128, 1)), atol=1e-12)
    np.testing.assert_allclose(fields["velocity"].values[7, 0], [1e-3, -2e-3], rtol=1e-9)
    np.testing.assert_allclose(fields["displacement"].values[-1, 0], [1e-3, -2e-3])
    np.testing.assert_allclose(fields["rigid_translation"].values[-1], [1e-3, -2e-3], rtol=1e-9)
    tracks = moved(np.diag([0.1, 0.0]))
    position = np.concatenate([tracks["position"].values, np.zeros((31, 81, 1))], axis=2)
    position[:, :, 2] = 1e-3 * TIMES[:, None]
    fields = marker_fields(make_tracks(position, TIMES, units="m"))
    np.testing.assert_allclose(fields["divergence"].values[-1], 0.1, atol=1e-12)
    np.testing.assert_allclose(fields["rigid_translation"].values[-1, 2], 1e-3)
    np.testing.assert_allclose(fields["velocity"].values[..., 2], 1e-3, rtol=1e-9)


def test_what_was_not_seen_is_nowhere_and_rest_is_the_mean_of_what_was():
    fields = marker_fields(hide(moved(np.diag([0.1, 0.1])), slice(10, 20), 4))
    for name in ("displacement", "velocity", "rigid_residual"):
        lost = np.isnan(fields[name].values).any(axis=2)
        assert lost.sum() == 10
        assert lost[10:20, 4].all()
    np.testing.assert_allclose(np.delete(fields["divergence"].values[15], 4), 2 * 0.1 * TIMES[15], atol=1e-12)
    rms = fields["rigid_residual_rms"].values
    np.testing.assert_allclose(rms[15], rms[14], rtol=0.1)
    position = np.array([[[1.0, 2.0], [0.0, 0.0]], [[3.0, 2.0], [np.nan, np.nan]], [[9.0, 9.0], [9.0, 9.0]]])
    np.testing.assert_array_equal(rest_positions(position, 2), [[2.0, 2.0], [0.0, 0.0]])
    assert np.isnan(rest_positions(np.full((3, 1, 2), np.nan), 2)).all()


def test_the_centroid_of_a_contact_is_where_markers_are_spread():
    """A spread around a point off the middle, that falls off as a Gaussian."""
    spot, width = np.array([1.5e-3, -0.5e-3]), 1e-3
    off = LAYOUT.position - spot
    shift = 0.2 * off * np.exp(-0.5 * (off**2).sum(axis=1) / width**2)[:, None]
    fields = marker_fields(make_tracks(LAYOUT.position + TIMES[:, None, None] * shift, TIMES, units="m"))
    assert np.linalg.norm(fields["contact_centroid"].values[-1] - spot) < 0.3e-3
    assert np.isnan(fields["contact_centroid"].values[0]).all(), "nothing is spread at rest"
    position = np.array([[[0.0, 0.0], [1.0, 0.0], [4.0, 4.0], [np.nan, np.nan]]])
    divergence = np.array([[0.2, 0.4, 0.05, np.nan]])
    np.testing.assert_allclose(contact_centroid(position, divergence, 0.1), [[0.75, 0.0]])


@pytest.mark.parametrize("frames", [5, 7, 21])
def test_velocity_is_that_of_the_known_filter(frames):
    assert window_frames(np.arange(100) / 30, (frames - 1) / 30) == frames
    position = np.random.default_rng(0).standard_normal((60, 4, 2))
    known = savgol_filter(position, frames, 2, deriv=1, delta=1 / 30, axis=0, mode="interp")
    np.testing.assert_allclose(smooth_velocity(position, np.arange(60) / 30, frames), known, atol=1e-9)


def test_velocities_of_parabolas_are_exact_and_noise_is_damped_as_stated():
    random = np.random.default_rng(0)
    times, factors = np.sort(random.uniform(0, 2, 80)), np.array([[1.0, -2.0], [0.5, 4.0]])
    position = (1.0 + 3.0 * times - 2.0 * times**2)[:, None, None] * factors
    truth = (3.0 - 4.0 * times)[:, None, None] * factors
    lost = random.random((80, 2)) < 0.2
    position[lost] = np.nan
    found = smooth_velocity(position, times, 15)
    np.testing.assert_array_equal(np.isnan(found[..., 0]), lost)
    np.testing.assert_allclose(found[~lost], truth[~lost], rtol=1e-6)
    noise, half, step = np.random.default_rng(0).standard_normal((4000, 10, 2)), 3, 1 / 30
    expected = np.sqrt(3 / (half * (half + 1) * (2 * half + 1))) / step
    assert smooth_velocity(noise, np.arange(4000) * step, 7)[3:-3].std() == pytest.approx(expected, rel=0.02)
    rare = np.zeros((20, 1, 2))
    rare[3:] = np.nan
    assert np.isnan(smooth_velocity(rare, np.arange(20.0), 5)).all()


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: window_frames(np.arange(4) / 30, 0.2), "has 4 frames, and the smoothing time spans 7"),
        (lambda: window_frames(np.zeros(1), 0.2), "spans 5"),
        (lambda: window_frames(TIMES, 0), "smoothing: got 0"),
        (lambda: marker_fields(moved(np.zeros((2, 2))).isel(time=slice(3))), "give a shorter smoothing time"),
        (lambda: marker_fields(moved(np.zeros((2, 2))), rest=99), "rest: got 99 frames, needs 1 to 31"),
        (lambda: rest_positions(np.zeros((3, 1, 2)), 0), "rest: got 0 frames, needs 1 to 3"),
    ],
)
def test_too_few_frames_are_refused(call, said):
    with pytest.raises(InputError, match=said):
        call()


def cloud(count, dim):
    return np.random.default_rng(dim).standard_normal((count, dim))


@pytest.mark.parametrize(("vector", "depth"), [((0.3, -0.2, 0.9), 1.0), ((0.0, 3.0, 0.0), 0.0)])
def test_a_rotation_in_3d_leaves_nothing_and_mirrors_nothing_flat(vector, depth):
    rest, turn = cloud(20, 3) * (1.0, 1.0, depth), Rotation.from_rotvec(vector)
    motions = fit_rigid_motions(rest, (turn.apply(rest) + 1.0)[None])
    np.testing.assert_allclose(motions.residual, 0.0, atol=1e-13)
    assert motions.rotation[0] == pytest.approx(turn.magnitude())


def test_the_fit_is_the_best_one_and_lost_markers_have_no_weight():
    rest = cloud(400, 2)
    noisy = rest + 0.3 * np.random.default_rng(1).standard_normal((1, 400, 2))
    motions = fit_rigid_motions(rest, noisy)
    centred = [np.column_stack([points - points.mean(axis=0), np.zeros(400)]) for points in (noisy[0], rest)]
    known, error = Rotation.align_vectors(*centred)
    assert (motions.residual**2).sum() == pytest.approx(error**2)
    assert motions.rotation[0] == pytest.approx(known.as_rotvec()[2])
    rest = cloud(20, 2)
    position = np.array([rest + 1.0, rest + 2.0, np.full_like(rest, np.nan)])
    position[0, 3] = np.nan
    rest[5] = np.nan
    motions = fit_rigid_motions(rest, position)
    assert np.argwhere(np.isnan(motions.residual[:2]).any(axis=2)).tolist() == [[0, 3], [0, 5], [1, 5]]
    np.testing.assert_allclose(motions.residual[~np.isnan(motions.residual)], 0.0, atol=1e-13)
    np.testing.assert_allclose(motions.translation[:2], [[1, 1], [2, 2]])
    assert np.isnan(motions.rotation).tolist() == [False, False, True]
    assert np.isnan(motions.translation[2]).all()


REST = ring_layout(1.0).position
TRIANGLES = marker_triangles(REST)


def test_triangles_fill_the_layout_and_there_are_none_of_too_few_markers_or_a_line():
    first, second = (REST[TRIANGLES[:, corner]] - REST[TRIANGLES[:, 0]] for corner in (1, 2))
    areas = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    assert (areas > 0).all()
    # The outer ring is a polygon of 32 corners with the radius 4.
    assert areas.sum() == pytest.approx(0.5 * 32 * 16 * np.sin(2 * np.pi / 32))
    assert len(marker_triangles(hexagonal_layout(1.0, 3).position)) == 54
    for points in (REST[:2], np.column_stack([np.arange(5.0), np.zeros(5)]), np.full((5, 2), np.nan)):
        assert marker_triangles(points).shape == (0, 3)
    assert triangle_gradients(REST, REST[None], np.empty((0, 3), dtype=int)).shape == (1, 0, 2, 2)
    flat = np.array([[0.0, 0.0], [1.0, 0.001], [2.0, 0.0], [1.0, 1.0]])
    assert sorted(map(sorted, marker_triangles(flat).tolist())) == [[0, 1, 3], [1, 2, 3]]
    rest = REST.copy()
    rest[3] = np.nan
    assert 3 not in marker_triangles(rest)


@given(arrays(float, (2, 2), elements=floats(-0.5, 0.5)))
def test_affine_motions_are_exact(gradient):
    found = triangle_gradients(REST, (REST + REST @ gradient.T + (5.0, -2.0))[None], TRIANGLES)
    np.testing.assert_allclose(found, np.broadcast_to(gradient, found.shape), atol=1e-12)
    expected = np.broadcast_to(strains(gradient), (*found.shape[:2], 3))
    np.testing.assert_allclose(green_strain(found), expected, atol=1e-12)


def test_lost_corners_take_their_triangles_with_them_and_means_do_without_and_weigh_by_area():
    growing = 1.1 * REST
    growing[0] = np.nan
    found = triangle_gradients(REST, growing[None], TRIANGLES)
    np.testing.assert_array_equal(np.isnan(found[0, :, 0, 0]), (TRIANGLES == 0).any(axis=1))
    means = marker_means(found[..., 0, 0], REST, TRIANGLES)
    assert np.isnan(means[0]).nonzero()[0].tolist() == [0]
    np.testing.assert_allclose(means[0, 1:], 0.1)
    rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-3.0, 0.0]])
    means = marker_means(np.array([[1.0, 5.0]]), rest, np.array([[0, 1, 2], [0, 2, 3]]))
    np.testing.assert_allclose(means, [[4.0, 1.0, 4.0, 5.0]])


def test_the_larger_principal_strain_keeps_its_sign():
    strain = np.array([[0.1, -0.3, 0.0], [0.2, 0.2, 0.1], [-0.1, -0.1, -0.3]])
    np.testing.assert_allclose(larger_principal(strain), [-0.3, 0.3, -0.4], rtol=1e-14)
