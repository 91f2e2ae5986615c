"""Problems with known answers, computed with the package's own models and solver."""
