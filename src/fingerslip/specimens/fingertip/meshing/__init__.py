"""How a fingertip is meshed: its sections in the plane, and the fingertip in space."""
