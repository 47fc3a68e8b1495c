"""Commands by name, each with its module, its heading and its line of help.

Made by `python -m tui.cli.derived`.
"""

from __future__ import annotations

COMMANDS: dict[str, tuple[str, str, str]] = {
    "accept": ("accept", "Run", "Run an acceptance test from a file."),
    "backup": ("backup", "Set up", "Back up a drive's settings to a file."),
    "block": ("block", "Set up", "Show or change a drive's indirect block or scanner."),
    "bundle": ("bundle", "Troubleshoot", "Collect all evidence about a line in one file."),
    "compare": ("compare", "Set up", "Compare settings of files, drives or factory defaults."),
    "counters": ("counters", "Troubleshoot", "Compare frame counts with the drive's own counters."),
    "demo": ("panel", "Profiles", "Open the panel on five running simulated drives."),
    "export": ("export", "Watch", "Export recorded values as CSV, or frames as pcapng."),
    "hold": ("hold", "Watch", "Keep polling drives so that they do not time out."),
    "identify": ("identify", "Watch", "Show a drive's vendor, model and version."),
    "journal": ("journal", "Watch", "Show writes, trips, runs and lost links of drives."),
    "lines": ("lines", "Share", "List named and remembered lines."),
    "listen": ("listen", "Troubleshoot", "Monitor traffic on a line; send nothing."),
    "plan": ("plan", "Set up", "Check a planned line: wiring, times and parts."),
    "ports": ("ports", "Troubleshoot", "List the serial ports of this computer."),
    "profiles": ("profiles", "Profiles", "List, show, check or confirm drive profiles."),
    "prove": ("prove", "Run", "Test how a drive reacts to communication loss."),
    "publish": ("publish", "Share", "Publish drive values to an MQTT broker."),
    "read": ("read", "Watch", "Read parameters from a drive."),
    "record": ("record", "Watch", "Record values to a file, always or around triggers."),
    "reference": ("single_orders", "Run", "Set a drive's reference."),
    "replay": ("replay", "Watch", "Show a record on the screens of the panel."),
    "report": ("report", "Watch", "Write a report on a drive to a file."),
    "reset": ("single_orders", "Run", "Reset a drive's fault."),
    "restore": ("restore", "Set up", "Restore a parameter set to a drive."),
    "run": ("run", "Run", "Run a motor until this command ends."),
    "scan": ("scan", "Troubleshoot", "Scan a line for drives."),
    "serve": ("serve", "Share", "Run headless and serve lines over Modbus TCP."),
    "simulate": ("simulate", "Profiles", "Serve simulated drives to any Modbus client."),
    "status": ("status", "Watch", "Show a drive's state, control source and fault."),
    "stop": ("stop", "Run", "Stop one drive, or every drive on a line."),
    "teach": ("teach", "Profiles", "Learn a raw value's scale from the drive's display."),
    "watch": ("watch", "Watch", "Poll parameters and print every cycle."),
    "why": ("why", "Troubleshoot", "Diagnose why a drive does not answer."),
    "write": ("write", "Set up", "Write settings to a drive."),
}
