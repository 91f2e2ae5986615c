"""Overlays show each marker that is seen with its arrow, or a field: colours between markers, arrows, the centroid."""

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.fields import marker_fields
from fingerslip.vision.overlay import RING_COLOURS, field_frames, overlay_frames
from fingerslip.vision.tracks import make_tracks
from unit.vision.scenes import GREY

COLOUR = np.dstack([GREY, GREY // 2, GREY // 3])


def tracks(**more):
    """Return two markers; the first moves by 20 px along x, the second is lost at the second time."""
    position = np.array([[[40.0, 60.0], [100.0, 60.0]], [[60.0, 60.0], [np.nan, np.nan]]])
    return make_tracks(position, [0.0, 0.1], units="px", ring=[0, 1], **more)


def coloured(frame, ring):
    """Tell which pixels below the text have the colour of a ring."""
    found = (np.abs(frame.astype(int) - RING_COLOURS[ring]).sum(axis=2) < 60) & (np.arange(120) > 30)[:, None]
    return np.asarray(found)


def columns(frame, ring):
    return np.flatnonzero(coloured(frame, ring).any(axis=0))


def test_markers_have_circles_and_arrows_in_the_colour_of_their_ring_or_mark():
    first, second = overlay_frames([GREY, GREY], tracks())
    assert first.shape == (120, 160, 3)
    for frame, ring, x in ((first, 0, 40), (first, 1, 100), (second, 0, 40)):
        assert x - 5 <= columns(frame, ring).min() <= x + 5
    assert columns(first, 0).max() <= 46, "no arrow at rest"
    assert 60 <= columns(second, 0).max() <= 66, "the head is at the marker"
    assert not coloured(second, 1).any(), "a lost marker is not drawn"
    assert (first[:30] == 255).all(axis=2).any(), "time and count"
    (frame,) = overlay_frames([GREY], tracks().isel(time=slice(1)), marked=np.array([[True, False]]))
    assert abs(columns(frame, 0).mean() - 40) < 3
    assert abs(columns(frame, 3).mean() - 100) < 3
    (frame,) = overlay_frames([GREY], tracks().isel(time=slice(1)), marked=np.array([[1.0, np.nan]]))
    assert not coloured(frame, 3).any(), "neither"
    assert (frame[30:, 90:110] == 255).all(axis=2).any()


def test_arrows_are_drawn_over_a_copy_of_frames_in_their_colours():
    arrows = np.zeros((2, 2, 2))
    arrows[0, 0] = [0.0, -30.0]
    (frame,) = overlay_frames([GREY], tracks().isel(time=slice(1)), arrows=arrows[:1])
    assert np.flatnonzero(coloured(frame, 0).any(axis=1)).max() == pytest.approx(90, abs=1)
    assert list(overlay_frames([], tracks().isel(time=slice(0)))) == []
    before = COLOUR.copy()
    frame = next(overlay_frames([COLOUR, COLOUR], tracks()))
    np.testing.assert_array_equal(COLOUR, before)
    assert frame[119, 159].tolist() == [90, 45, 30]


REST = np.array([[40.0, 40.0], [120.0, 40.0], [40.0, 100.0], [120.0, 100.0]])
MIDDLE = np.array([80.0, 70.0])


def fields(growth=0.1, units="px"):
    times = np.arange(8) / 30.0
    shares = growth * times / times[-1]
    return marker_fields(make_tracks(MIDDLE + (REST - MIDDLE) * (1 + shares)[:, None, None], times, units=units))


def drawn(name, found, number=-1):
    return list(field_frames([GREY] * 8, found, name))[number].astype(int)


@pytest.mark.parametrize("name", ["divergence", "strain"])
def test_what_grows_is_orange_and_what_shrinks_is_blue(name):
    grown, shrunk = (drawn(name, fields(growth))[60, 75] for growth in (0.1, -0.1))
    assert grown[2] > grown[0] + 50
    assert shrunk[0] > shrunk[2] + 50
    # At rest there is nothing to see.
    assert (drawn(name, fields(), 0)[60, 75] == 90).all()


def test_colours_are_missing_where_a_marker_is_and_arrows_begin_at_the_markers():
    found = fields()
    found["divergence"][:, 0] = np.nan
    assert (drawn("divergence", found)[48, 60] == 90).all()
    picture, plain = drawn("velocity", fields()), drawn("contact_centroid", fields())
    start, along = MIDDLE + 1.1 * (REST[3] - MIDDLE), np.array([0.8, 0.6])
    # The longest arrow is nine tenths of the distance of neighbours, 60 px at rest.
    for far, there in ((-5.0, False), (2.0, True), (20.0, True)):
        x, y = np.round(start + far * along).astype(int)
        assert (picture[y, x] != plain[y, x]).any() == there
    assert (plain[70, 80] != 90).any(), "the centroid is a cross"
    assert (drawn("contact_centroid", fields(-0.1))[40:] == 90).all()


METRES = make_tracks(np.zeros((1, 1, 2)), [0.0], units="m")


@pytest.mark.parametrize(
    ("draw", "said"),
    [
        (lambda: overlay_frames([GREY], tracks(), arrows=np.zeros((1, 2, 2))), r"arrows: got shape \(1, 2, 2\)"),
        (lambda: list(overlay_frames([GREY], tracks())), "frames: got 1, needs 2"),
        (lambda: overlay_frames([GREY], METRES), "tracks: position: is in m, needs px"),
        (lambda: field_frames([GREY], fields(), "shear"), "field: got 'shear', needs one of displacement, velocity"),
        (lambda: field_frames([GREY], fields(units="m"), "curl"), "fields: position: is in m, needs px"),
        (lambda: list(field_frames([GREY], fields(), "curl")), "got 1, needs 8, as many as the fields have times"),
    ],
)
def test_what_does_not_fit_is_refused(draw, said):
    with pytest.raises(InputError, match=said):
        draw()
