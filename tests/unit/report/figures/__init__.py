"""Tests of fingerslip.report.figures."""
