"""The folders of a study's results: what is written there, whole or not at all, and read back."""
