"""What the verbs of the command line show of presets, studies and results."""
