"""The plain tracker that others are compared with: blobs of each frame, each marker takes the nearest one.

That is how Cordova Bulens et al. 2023 describe theirs: OpenCV's blobs, identity from the nearest marker of the frame
before. Several markers may take the same blob; without any blob a marker stays where it was.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Floats = NDArray[np.float64]


def blob_detector(radius: float, bright: bool = False) -> cv2.SimpleBlobDetector:
    """Return OpenCV's blob detector, told how large markers are."""
    settings = cv2.SimpleBlobDetector_Params()
    settings.filterByColor, settings.blobColor = True, 255 if bright else 0
    settings.minThreshold, settings.maxThreshold, settings.thresholdStep = 10, 250, 10
    settings.filterByArea = True
    settings.minArea, settings.maxArea = 0.3 * math.pi * radius**2, 3.0 * math.pi * radius**2
    settings.filterByCircularity, settings.filterByConvexity, settings.filterByInertia = False, False, False
    settings.minDistBetweenBlobs = radius
    return cv2.SimpleBlobDetector_create(settings)


def track_nearest(frames: Iterable[NDArray[np.uint8]], start: Floats, radius: float, bright: bool = False) -> Floats:
    """Follow markers from where they are at first (n, 2); returns positions (t, n, 2), never NaN."""
    detector, here, course = blob_detector(radius, bright), start.copy(), []
    for frame in frames:
        found = np.array([blob.pt for blob in detector.detect(frame)])
        if len(found):
            here = found[cKDTree(found).query(here)[1]]
        course.append(here)
    return np.array(course)
