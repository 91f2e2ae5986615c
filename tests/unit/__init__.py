"""One test file for every module of the package, at the same path."""
