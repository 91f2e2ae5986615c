"""The command line: a file for each verb, with its arguments and one call into the package."""
