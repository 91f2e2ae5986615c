"""The discrete system of a model: what is wrong with it, its matrices, loads and maps, its time integration scheme."""
