"""Many quasi-static motions of one elastic body: its answers to contact forces are computed once."""
