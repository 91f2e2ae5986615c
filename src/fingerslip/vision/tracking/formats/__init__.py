"""Formats of tactile recordings that laboratories have, in and out."""
