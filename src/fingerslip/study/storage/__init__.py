"""The folder of a study's results: its files, written whole or not at all, and read back for tables and reports."""
