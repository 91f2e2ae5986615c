"""From the runs of a study to computed results: models are built, grouped and computed in several processes."""
