"""`drivepanel ports`: the serial ports of this machine."""

from __future__ import annotations

from ..shared.options import json_option
from ..shared.registration import command
from ..shared.rows import say_row, titled
from ..shared.say import say

PORT = titled(19)


@command("List the serial ports of this computer.", group="Troubleshoot")
@json_option
def ports(as_json: bool) -> None:
    """List the serial ports of this computer, and the programs that use them."""
    from tui.bus.transport.port_names import lasting_name
    from tui.bus.transport.ports import holder, list_ports

    from ..documents.other_documents import PortDocument
    from ..shared.output import print_json

    found = [(port, holder(port.path)) for port in list_ports()]
    names = {port.path: lasting_name(port.path) for port, _ in found}
    if as_json:
        rows = []
        for port, by in found:
            name = names[port.path]
            lasts = name.lasting and name.path != port.path
            rows.append(
                PortDocument(
                    path=port.path,
                    description=port.description,
                    holder=by,
                    lasting=name.path if lasts else None,
                    adapter=name.adapter or None,
                )
            )
        print_json(rows)
        return
    if not found:
        say("No serial port found. Plug in the adapter, or use tcp:HOST or rtu-tcp:HOST:PORT.")
    for port, by in found:
        used = (f"in use by {by}",) if by else ()
        say_row(PORT, (port.path, "  ".join((port.description, *used))))
        name = names[port.path]
        if name.lasting and name.path != port.path:
            say_row(PORT, ("", f"always {name.path}"))
        if name.shared:
            say_row(PORT, ("", "without a serial number of its own: known by its socket alone"))
