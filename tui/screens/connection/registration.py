"""Registration of Line: its title, actions and keys."""

from __future__ import annotations

from ..keys.action import Registration, key_rows

SCAN_SETTINGS = "Scan at other baud rates and formats, likely ones first. Asks first."

REGISTERED = (
    Registration(
        title="Line",
        about="lines, and the drives that answer on one",
        digit="1",
        narrow="Line",
        actions=key_rows(
            ("open_chosen", "enter", "open", "Open the line or drive under the cursor."),
            ("scan", "s", "scan", "Scan the addresses for drives; drives already found stay."),
            ("addresses", "c", "address", "Change the addresses to scan: 1-31, or 1,3,5-7."),
            (
                "type_line",
                "n",
                "new",
                "Type a line to open: serial, TCP, RTU over TCP, simulated.",
            ),
            ("stop_scan", "escape", "", "Leave the field, end the scan, or return to the drives."),
            ("scan_settings", "", "", SCAN_SETTINGS),
            ("refresh_lines", "", "", "Update the list of serial ports."),
            ("disconnect", "", "", "Close the line. Asks first if a drive reacts to that."),
        ),
    ),
)
