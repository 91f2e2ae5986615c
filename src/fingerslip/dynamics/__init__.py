"""Motion over time: the discrete system of a model, its time integration, and the march that makes a history."""
