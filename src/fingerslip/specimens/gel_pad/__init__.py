"""What an optical sensor of the GelSight kind is, in numbers: a flat gel, a grid of markers, and its presets."""
