"""OpenCV is optional: where it is missing, the error says how to get it."""

from __future__ import annotations

import sys

import pytest

from fingerslip.errors import InputError
from fingerslip.vision.video import opencv


def test_opencv_is_found():
    assert callable(opencv().imread)


def test_missing_opencv_is_told_with_the_repair(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(InputError, match=r'OpenCV is missing .*; pip install "fingerslip\[vision\]"'):
        opencv()
