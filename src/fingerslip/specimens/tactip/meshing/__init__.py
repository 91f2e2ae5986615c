"""How a TacTip becomes a mesh: its section in the plane, and its half or the whole of it in space."""
