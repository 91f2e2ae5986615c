"""Results in 3D: a scene that is shown in a window, as a picture or as a film."""
