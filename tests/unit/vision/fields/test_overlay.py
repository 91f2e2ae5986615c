"""Overlays of fields: colours between markers, arrows, the centroid, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.fields import marker_fields
from fingerslip.vision.overlay import SHOWN_FIELDS, field_frames, write_field_overlay
from fingerslip.vision.tracks import make_tracks
from fingerslip.vision.video import read_frames

GREY = np.full((120, 160), 90, dtype=np.uint8)
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


def test_colours_are_missing_where_a_marker_is():
    found = fields()
    found["divergence"][:, 0] = np.nan
    assert (drawn("divergence", found)[48, 60] == 90).all()


def test_arrows_of_a_field_begin_at_the_markers():
    picture, plain = drawn("velocity", fields()), drawn("contact_centroid", fields())
    start, along = MIDDLE + 1.1 * (REST[3] - MIDDLE), np.array([0.8, 0.6])
    # The longest arrow is nine tenths of the distance of neighbours, 60 px at rest.
    for far, there in ((-5.0, False), (2.0, True), (20.0, True)):
        x, y = np.round(start + far * along).astype(int)
        assert (picture[y, x] != plain[y, x]).any() == there


def test_centroid_is_a_cross_where_markers_spread():
    assert (drawn("contact_centroid", fields())[70, 80] != 90).any()
    assert (drawn("contact_centroid", fields(-0.1))[40:] == 90).all()


def test_video_has_all_frames_and_colour_is_kept(tmp_path: Path) -> None:
    found = fields().assign_attrs(frame_rate=30.0)
    colour = np.dstack([GREY, GREY, GREY])
    for name in SHOWN_FIELDS:
        assert write_field_overlay([colour] * 8, found, name, tmp_path / f"{name}.mkv") == 8
        np.testing.assert_array_equal(
            list(read_frames(tmp_path / f"{name}.mkv", colour="bgr")), list(field_frames([GREY] * 8, found, name))
        )


def test_what_cannot_be_drawn_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="field: got 'shear', needs one of displacement, velocity"):
        field_frames([GREY], fields(), "shear")
    with pytest.raises(InputError, match="fields: position: is in m, needs px"):
        field_frames([GREY], fields(units="m"), "curl")
    with pytest.raises(InputError, match="frames: got 1, needs 8, as many as the fields have times"):
        list(field_frames([GREY], fields(), "curl"))
    with pytest.raises(InputError, match="fields: frame_rate: is not there"):
        write_field_overlay([GREY], fields(), "curl", tmp_path / "a.mkv")
