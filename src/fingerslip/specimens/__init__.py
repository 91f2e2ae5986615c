"""What is pressed on a surface: a folder for each specimen, with its numbers, its presets and how it is meshed."""
