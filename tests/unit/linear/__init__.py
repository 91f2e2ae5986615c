"""Tests of fingerslip.linear, module by module."""
