"""Data sets of simulated trials: from the runs of a study to marker tracks, labels and conditions."""
