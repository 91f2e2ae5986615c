"""Cameras that look at markers: lens, place, pictures with every fault of real ones, and a quick camera of points."""

#: Frames a second that follow from what Cordova Bulens et al. 2023 print: 100 frames in about 1.5 s [1/s].
PUBLISHED_FRAME_RATE = 200.0 / 3.0
