"""Motion over time: the discrete system of a model, its time integration, and the loop that makes a history."""
