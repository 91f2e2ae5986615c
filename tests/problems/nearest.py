"""Plain trackers that others are compared with: nearest blobs, optical flow alone, and trackpy.

The first is how Cordova Bulens et al. 2023 describe theirs: OpenCV's blobs, identity from the nearest marker of the
frame before. Several markers may take the same blob; without any blob a marker stays where it was.
"""

import math

import cv2
import numpy as np
from scipy.spatial import cKDTree


def blob_detector(radius, bright=False):
    """Return OpenCV's blob detector, told how large markers are."""
    settings = cv2.SimpleBlobDetector_Params()
    settings.filterByColor, settings.blobColor = True, 255 if bright else 0
    settings.minThreshold, settings.maxThreshold, settings.thresholdStep = 10, 250, 10
    settings.filterByArea = True
    settings.minArea, settings.maxArea = 0.3 * math.pi * radius**2, 3.0 * math.pi * radius**2
    settings.filterByCircularity, settings.filterByConvexity, settings.filterByInertia = False, False, False
    settings.minDistBetweenBlobs = radius
    return cv2.SimpleBlobDetector_create(settings)


def track_nearest(frames, start, radius, bright=False):
    """Follow markers from where they are at first (n, 2); returns positions (t, n, 2), never NaN."""
    detector, here, course = blob_detector(radius, bright), start.copy(), []
    for frame in frames:
        found = np.array([blob.pt for blob in detector.detect(frame)])
        if len(found):
            here = found[cKDTree(found).query(here)[1]]
        course.append(here)
    return np.array(course)


def track_flow(frames, start):
    """Follow markers by pyramidal Lucas-Kanade, forwards and backwards; NaN from where both disagree by a pixel."""
    here, before, course = start.astype(np.float32)[:, None], None, []
    gone = np.zeros(len(start), dtype=bool)
    for frame in frames:
        if before is not None:
            there, status, _ = cv2.calcOpticalFlowPyrLK(before, frame, here, None, winSize=(21, 21), maxLevel=3)
            back, _, _ = cv2.calcOpticalFlowPyrLK(frame, before, there, None, winSize=(21, 21), maxLevel=3)
            gone |= (status[:, 0] != 1) | (np.linalg.norm((back - here)[:, 0], axis=1) > 1.0)
            here = there
        before = frame
        course.append(np.where(gone[:, None], np.nan, here[:, 0]))
    return np.array(course)


def track_trackpy(frames, start, radius, bright=False):
    """Follow markers by trackpy: located in each frame, linked within half their distance with a memory of ten."""
    import pandas as pd
    import trackpy

    spacing = float(np.median(cKDTree(start).query(start, k=2)[0][:, 1]))
    trackpy.quiet()
    images = [frame if bright else 255 - frame for frame in frames]
    size = 2 * round(1.3 * radius) + 1
    places = [trackpy.locate(image, size, topn=2 * len(start)).assign(frame=t) for t, image in enumerate(images)]
    try:
        linked = trackpy.link(pd.concat(places), 0.45 * spacing, memory=10)
    except trackpy.SubnetOversizeException:
        return np.full((len(images), *start.shape), np.nan)
    first = linked[linked["frame"] == 0]
    apart, nearest = cKDTree(first[["x", "y"]].to_numpy()).query(start)
    position = np.full((len(images), *start.shape), np.nan)
    for marker, (distance, row) in enumerate(zip(apart, nearest, strict=True)):
        track = linked[linked["particle"] == first["particle"].iloc[row]]
        if distance < radius:
            position[track["frame"].to_numpy(), marker] = track[["x", "y"]].to_numpy()
    return position
