"""The runs of a study repeated with finer settings, for error bars."""
