"""``python -m fingerslip`` is the command ``fingerslip``."""

from __future__ import annotations

from fingerslip.commands.app import app

if __name__ == "__main__":
    app(prog_name="fingerslip")
