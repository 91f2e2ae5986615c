"""What ``show``, ``check``, ``mesh`` and ``view`` print, draw or open: presets, studies and stored results.

Nothing here computes a run.
"""
