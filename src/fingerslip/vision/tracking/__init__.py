"""Tracking of markers: from a video, synthetic or filmed, to tracks."""
