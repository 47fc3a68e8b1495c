"""Commands by name, each with its module and its line of help.

Made by `python -m tui.cli.derived`.
"""

from __future__ import annotations

COMMANDS: dict[str, tuple[str, str]] = {
    "accept": ("accept", "Run an acceptance test from a file."),
    "backup": ("backup", "Back up a drive's settings to a file."),
    "block": ("block", "Show or change a drive's indirect block or scanner."),
    "bundle": ("bundle", "Collect all evidence about a line in one file."),
    "compare": ("compare", "Compare settings of files, drives or factory defaults."),
    "counters": ("counters", "Compare frame counts with the drive's own counters."),
    "demo": ("panel", "Open the panel on five running simulated drives."),
    "hold": ("hold", "Keep polling drives so that they do not time out."),
    "identify": ("identify", "Show a drive's vendor, model and version."),
    "journal": ("journal", "Show writes, trips, runs and lost links of drives."),
    "lines": ("lines", "List named and remembered lines."),
    "listen": ("listen", "Monitor traffic on a line; send nothing."),
    "ports": ("ports", "List the serial ports of this computer."),
    "profiles": ("profiles", "List, show or check drive profiles."),
    "prove": ("prove", "Test how a drive reacts to communication loss."),
    "publish": ("publish", "Publish drive values to an MQTT broker."),
    "read": ("read", "Read parameters from a drive."),
    "record": ("record", "Record values to a file, always or around triggers."),
    "reference": ("single_orders", "Set a drive's reference."),
    "replay": ("replay", "Show a record on the screens of the panel."),
    "report": ("report", "Write a report on a drive to a file."),
    "reset": ("single_orders", "Reset a drive's fault."),
    "restore": ("restore", "Restore a parameter set to a drive."),
    "run": ("run", "Run a motor until this command ends."),
    "scan": ("scan", "Scan a line for drives."),
    "serve": ("serve", "Run headless and serve lines over Modbus TCP."),
    "simulate": ("simulate", "Serve simulated drives to any Modbus client."),
    "status": ("status", "Show a drive's state, control source and fault."),
    "stop": ("stop", "Stop one drive, or every drive on a line."),
    "teach": ("teach", "Learn a raw value's scale from the drive's display."),
    "watch": ("watch", "Poll parameters and print every cycle."),
    "why": ("why", "Diagnose why a drive does not answer."),
    "write": ("write", "Write settings to a drive."),
}
