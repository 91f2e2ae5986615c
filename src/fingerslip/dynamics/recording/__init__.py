"""From states to the arrays of a history, and what a history says of its model."""
