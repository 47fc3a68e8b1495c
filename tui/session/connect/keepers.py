"""The start of a keeper, the process that holds a line; set by the entry of the program.

The keeper stands above the sessions, which therefore cannot import it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.bus.share.keeping import KeeperStarter

start: KeeperStarter | None = None
"""None: a program that opens a line first holds it itself."""
