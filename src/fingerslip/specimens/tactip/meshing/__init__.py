"""How a TacTip becomes a mesh: its section in 2D, and its half or the whole of it in 3D."""
