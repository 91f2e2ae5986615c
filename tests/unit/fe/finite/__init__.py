"""Tests of fingerslip.fe.finite, module by module."""
