"""Studies whose runs are simulated, part by part."""
