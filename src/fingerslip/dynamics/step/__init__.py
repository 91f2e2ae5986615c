"""One time step: where it starts, its contact, where it ends, and what stays the same from step to step."""
