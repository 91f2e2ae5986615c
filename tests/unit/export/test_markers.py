"""The older place of the function that makes tracks of a history."""

from __future__ import annotations

import fingerslip.marker_tracks
from fingerslip.export import formats as markers


def test_tracks_of_histories_have_one_function():
    assert markers.marker_tracks is fingerslip.marker_tracks.marker_tracks
