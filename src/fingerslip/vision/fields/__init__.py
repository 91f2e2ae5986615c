"""Fields from markers: displacement, velocity, strain, divergence, curl, what is left of a rigid motion, contact."""
