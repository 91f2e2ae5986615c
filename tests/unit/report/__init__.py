"""Tests of fingerslip.report, module by module."""
