"""Tests of fingerslip.report.page."""
