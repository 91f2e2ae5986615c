"""Tests of fingerslip.parameters."""
