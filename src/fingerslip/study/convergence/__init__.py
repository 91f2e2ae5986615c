"""Error bars: the runs of a study repeated with finer meshes, steps and contact stiffness and other damping."""
