"""Cameras that look at markers: lens, place, pictures with every fault of real ones, and a quick camera of points."""
