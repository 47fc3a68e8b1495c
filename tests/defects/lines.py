"""Defects of the name of a line, and of the check that it is still the same."""

from __future__ import annotations

from .defect import Defect

KNOWN = "tests/session/test_known_line.py"
NAMES = "tests/bus/test_port_names.py"
NAMED = "tests/session/test_named_lines.py"
COMMANDS = "tests/cli/test_lines.py"

DEFECTS = (
    Defect(
        "shared-by-id-name-believed",
        "tui/bus/transport/port_names.py",
        "own = bool(usb.serial) and not _has_twin(usb, os.path.basename(real), system)",
        "own = True",
        "With two adapters of one make, settings are written to the drive on the wrong one.",
        (f"{NAMES}::test_adapters_with_the_same_serial_number_are_distinguished",),
    ),
    Defect(
        "another-adapter-not-noticed",
        "tui/session/connect/known_line.py",
        "before is not None and before != name.key:",
        "before is not None and not name.key:",
        "After adapters were replugged, the motor of another machine starts.",
        (f"{KNOWN}::test_other_adapter_under_the_same_name_holds_the_line",),
    ),
    Defect(
        "another-drive-not-noticed",
        "tui/session/connect/known_lines.py",
        "return self.stated == now.stated",
        "return self.vendor == now.vendor",
        "A replaced drive runs with the commands meant for the earlier one.",
        (f"{KNOWN}::test_other_drive_at_an_address_holds_the_line",),
    ),
    Defect(
        "changed-line-accepted-unasked",
        "tui/session/connect/known_line.py",
        "if device not in self._changed and None not in self._changed and before != now:",
        "if before != now:\n                self._changed = {}",
        "The second command writes to the wrong drive, as the first one accepted it as known.",
        (f"{KNOWN}::test_other_drive_at_an_address_holds_the_line",),
    ),
    Defect(
        "held-line-writes",
        "tui/bus/limits.py",
        "    if held and request.changes:\n        return held\n",
        "",
        "A line on hold accepts writes from code that requires no arming.",
        (f"{KNOWN}::test_held_line_accepts_stops_only",),
    ),
    Defect(
        "held-line-keeps-a-stop-back",
        "tui/bus/line.py",
        'held = "" if priority is Priority.STOP else self.held',
        "held = self.held",
        "A motor cannot be stopped because the adapter was changed.",
        (
            f"{KNOWN}::test_real_line_is_held_too",
            f"{COMMANDS}::test_stop_is_sent_to_a_changed_drive",
        ),
    ),
    Defect(
        "held-line-arms",
        "tui/session/arming.py",
        "return self._line.held or self.trouble()",
        "return self.trouble()",
        "The panel shows a drive as armed that accepts no command.",
        (f"{KNOWN}::test_held_line_arms_no_drive",),
    ),
    Defect(
        "armed-though-the-line-changed",
        "tui/session/arming.py",
        "        if self._line.held:\n            self.disarm(",
        "        if not self._line.link:\n            self.disarm(",
        "A drive stays armed although another adapter now has its line's name.",
        (f"{KNOWN}::test_held_line_arms_no_drive",),
    ),
    Defect(
        "start-recorded-by-number",
        "tui/session/starts/starts.py",
        "line=remembered_text(task.record.line)",
        "line=task.record.line",
        "A motor left running is searched for on the adapter that now has the old number.",
        (f"{KNOWN}::test_recorded_start_is_found_at_the_new_port_of_its_adapter",),
    ),
    Defect(
        "name-drops-the-address",
        "tui/cli/shared/line_argument.py",
        'usual |= {"device": (named.device,), "devices": (named.device,)}',
        'usual |= {"devices": (named.device,)}',
        "A command with a drive's name goes to the drive at address 1.",
        (f"{COMMANDS}::test_name_replaces_a_line",),
    ),
    Defect(
        "named-profile-for-every-drive",
        "tui/cli/shared/line_argument.py",
        '    if ctx.params.get("every"):\n        return None\n',
        "",
        "A stop of all sends one family's stop word to drives of other families.",
        (f"{COMMANDS}::test_profile_of_a_name_applies_to_its_drive_only_in_stop_all",),
    ),
    Defect(
        "broken-settings-keep-a-stop-back",
        "tui/session/connect/named_lines.py",
        "        if found := _salvaged(line_settings().text, text):\n            return found\n",
        "",
        "A missing bracket in the settings file prevents stopping a motor.",
        (f"{NAMED}::test_stop_finds_its_line_in_a_broken_file",),
    ),
    Defect(
        "address-lost-in-a-broken-file",
        "tui/session/connect/named_lines.py",
        'return found._replace(device=int(parts["device"]))',
        "return found",
        "A stop by name stops the drive at address 1 while the named one keeps running.",
        (f"{NAMED}::test_stop_finds_its_drive_in_a_broken_file",),
    ),
    Defect(
        "first-word-taken-for-the-line",
        "tui/cli/shared/line_argument.py",
        "if isinstance(opts, MutableMapping) and self._is_left_out(ctx, opts):",
        "if False:",
        "With DRIVEPANEL_LINE, a code is taken for the line, and the command is refused.",
        (f"{COMMANDS}::test_environment_selects_the_line",),
    ),
)
