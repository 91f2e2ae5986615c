"""Slip detection from marker tracks: labels, data sets, features, classifiers, and their evaluation."""
