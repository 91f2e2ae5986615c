"""What an optical sensor of the TacTip kind is, in numbers: dome, ridged skin, gel, rods, markers, and its presets."""
