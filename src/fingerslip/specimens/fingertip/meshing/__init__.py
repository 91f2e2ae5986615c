"""How a fingertip is meshed: its sections in 2D, and the fingertip in 3D."""
