"""Tests of fingerslip.commands."""
