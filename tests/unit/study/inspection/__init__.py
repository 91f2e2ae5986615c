"""Tests of fingerslip.slip, module by module."""
