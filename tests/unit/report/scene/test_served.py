"""Where a browser finds a result."""

from __future__ import annotations

from fingerslip.report.scene.served import LOCAL, Served


def test_only_this_machine_can_look_unless_told_otherwise() -> None:
    assert Served().host == LOCAL == "127.0.0.1"
