"""How good detectors are: splits without leakage, scores of frames and of events, and a benchmark to enter."""
