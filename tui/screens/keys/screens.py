"""The list of screens; each package registers its own."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module

from .action import Registration

PACKAGES = (
    "connection",
    "monitor",
    "parameters",
    "blocks",
    "faults",
    "control",
    "frames",
    "trend",
    "messages",
    "startup",
    "wiring",
)
"""Packages of tui.screens, in the order in which their screens are listed."""


def _registered() -> Iterator[Registration]:
    for package in PACKAGES:
        # by name: this package is a layer below the screens, and must not import them
        yield from import_module(f"tui.screens.{package}.registration").REGISTERED


SCREENS: tuple[Registration, ...] = tuple(_registered())
TABBED = tuple(screen for screen in SCREENS if screen.digit)
"""Screens with a digit key and a tab."""
EVERYWHERE = tuple(screen.name for screen in SCREENS)
"""Names of all screens."""
