"""Tests of fingerslip.dynamics, module by module."""
