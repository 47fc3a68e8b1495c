"""`drivepanel ports`: the serial ports of this machine."""

from __future__ import annotations

import click

from ..shared.errors import told
from ..shared.options import json_option
from ..shared.say import say


@click.command()
@json_option
@told
def ports(as_json: bool) -> None:
    """List the serial ports of this machine and who holds them."""
    from tui.bus.transport.ports import holder, list_ports

    from ..shared.output import print_json

    found = [(port, holder(port.path)) for port in list_ports()]
    if as_json:
        print_json(
            [{"path": p.path, "description": p.description, "holder": by} for p, by in found]
        )
        return
    if not found:
        say("No serial port found. Plug in the adapter, or use tcp:HOST or rtu-tcp:HOST:PORT.")
    for port, by in found:
        used = f"  in use by {by}" if by else ""
        say(f"{port.path:<20} {port.description}{used}", indent=21)
