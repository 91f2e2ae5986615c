"""Many steps of a reduced body in 2D in one compiled function: the fast path."""
