"""A progress of a study that keeps what it is told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fingerslip.study.running.progress import StudyProgress


class Told(StudyProgress):
    """Keeps what it is told, in order; a message is a tuple of one text."""

    def __init__(self) -> None:
        self.told: list[tuple[Any, ...]] = []

    def begin(self, names: Sequence[str]) -> None:
        self.told.append(("begin", *names))

    def advance(self, name: str, fraction: float) -> None:
        self.told.append((name, fraction))

    def finish(self, name: str, outcome: str) -> None:
        self.told.append((name, outcome))

    def say(self, message: str) -> None:
        self.told.append((message,))

    @property
    def messages(self) -> list[str]:
        return [entry[0] for entry in self.told if len(entry) == 1]
