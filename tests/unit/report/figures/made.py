"""Histories and what is read off their figures, for tests of the figures."""

import numpy as np

from fingerslip.slip import find_events
from unit.synthetic import Process, make

HISTORY = make(Process())
EVENTS = find_events(HISTORY)
HISTORIES = {f"run {number}": HISTORY for number in range(5)}
ALL = dict.fromkeys(HISTORIES, EVENTS)
NO_SLIDE = make(Process(phases=(("press", 0.0, 1.0), ("hold", 1.0, 2.0))))
APART = HISTORY.assign(contact_state=HISTORY["contact_state"] * 0)
BARE = HISTORY.drop_dims("site")


def panels(figure):
    return [axes for axes in figure.axes if axes.get_visible()]


def titles(figure):
    """Return the titles of the panels that have one, in one line each."""
    texts = [" ".join(axes.get_title(loc="left").split()) for axes in panels(figure)]
    return [text for text in texts if text]


def texts(axes):
    return [text.get_text() for text in axes.texts]


def line(axes, label):
    """Return the line of a panel with a label."""
    return next(line for line in axes.lines if line.get_label() == label)


def marked(axes):
    """Return the times of the vertical lines of a panel [s]."""
    lines = [np.asarray(line.get_xdata(), dtype=float) for line in axes.lines]
    return sorted(float(x[0]) for x in lines if x.size == 2 and x[0] == x[1])


def words(figure):
    supers = {figure.get_suptitle(), figure.get_supylabel()}
    labels = {text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel())}
    keys = {text.get_text() for legend in figure.legends for text in legend.get_texts()}
    return supers | labels | keys
