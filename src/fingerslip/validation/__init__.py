"""Validation: the shipped studies beside what papers print: all of Wang et al. (2014), the mechanics of bulens2023."""
