"""Tracks of the markers of a simulated sensor; they are made in :mod:`fingerslip.marker_tracks`."""

from __future__ import annotations

from fingerslip.marker_tracks import marker_tracks

__all__ = ["marker_tracks"]
