"""The linear solvers. Every module here with a `SOLVER` is found, and the preferred one that is available is taken."""
