"""Tests of fingerslip.report.tables."""
