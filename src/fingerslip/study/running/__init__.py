"""Running a study: models are built, grouped and computed, side by side or together."""
