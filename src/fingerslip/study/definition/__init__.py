"""The study file: what it may hold, how it is read, and the runs that it makes."""
