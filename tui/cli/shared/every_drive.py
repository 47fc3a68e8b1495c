"""The drives that answer on a line, for a command that takes them all."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .errors import LINE_TROUBLE, Failure
from .options import Target

if TYPE_CHECKING:
    from tui.session.connect.identify import ScanResult
    from tui.session.connect.open_line import OpenLine

USUAL_SEARCH = "1-10"
"""Addresses that are searched unless others are named."""


async def every_drive(opened: OpenLine, target: Target, addresses: str | None) -> Target:
    """The target with every drive that answers at the addresses, or on a simulated line.

    Raises LinkSyntaxError for invalid addresses, Failure if no drive answers.
    """
    from tui.session.connect.addresses import parse_addresses
    from tui.session.connect.search import Search

    wanted = opened.devices if addresses is None and opened.devices else None
    devices = wanted or parse_addresses(addresses or USUAL_SEARCH)
    found: list[int] = []

    async def take(result: ScanResult) -> None:
        found.append(result.device)

    await Search(devices, patient=opened.simulation is not None).run(opened.line, take)
    if not found:
        raise Failure(f"No answer at {addresses or USUAL_SEARCH}.", LINE_TROUBLE)
    first, *others = sorted(found)
    return target._replace(device=first, others=tuple(others))
