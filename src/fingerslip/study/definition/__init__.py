"""The study file: what it may hold, how it is read with all its mistakes, and the runs that its sweep makes."""
