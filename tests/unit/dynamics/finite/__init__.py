"""Tests of fingerslip.dynamics.finite, module by module."""
