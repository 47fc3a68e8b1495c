"""Next steps, a sentence each, for every check of the diagnosis; pure functions.

Also conclusions on the sender's speed from bytes that form no frame.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from math import log

from tui.bus.errors import PortMissing
from tui.bus.link import SerialLink
from tui.drive.profile import library
from tui.drive.sentences import any_of

from .evidence import DiagnosticEvidence
from .family import address_hint, as_factory, settings_hints, speed_hint, wiring_hints

USUAL_BAUDS = (1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200)
USUAL_FORMATS = ("8E1", "8N1", "8N2", "8O1")
SAME_SPEED = 1.3
"""Greatest ratio of received to due bytes that still indicates the same speed."""


_SAME_SPEED = "the speed is right, but the format is probably wrong"
_SLOWER = "the drive sends more slowly"
_SLOWER_AT = "the drive sends more slowly, probably at {baud} bit/s"
_FASTER = "the drive sends faster"
_FASTER_AT = "the drive sends faster, probably at {baud} bit/s"


def speed_text(sight: DiagnosticEvidence) -> str:
    """Return the conclusion from the number of bytes: a receiver at half the speed sees half of
    them."""
    came, due = sight.heard.compared
    if not came or not due:
        return ""
    likely = likely_baud(sight)
    if same_speed(sight):
        text = _SAME_SPEED
    elif came > due:
        text = _SLOWER_AT if likely else _SLOWER
    else:
        text = _FASTER_AT if likely else _FASTER
    return f"{came} bytes arrived instead of {due}, so {text.format(baud=likely)}"


def same_speed(sight: DiagnosticEvidence) -> bool:
    """Return True if the number of received bytes is about the number due."""
    came, due = sight.heard.compared
    return bool(came and due) and 1 / SAME_SPEED < came / due < SAME_SPEED


def other_formats(sight: DiagnosticEvidence) -> tuple[str, ...]:
    """Return the family's formats other than the line's; none for a device server."""
    if not isinstance(sight.link, SerialLink):
        return ()
    known = sight.profile.data.link.formats if sight.profile is not None else ()
    return tuple(format_ for format_ in known or USUAL_FORMATS if format_ != sight.link.format)


def likely_baud(sight: DiagnosticEvidence) -> int | None:
    """Return the other baud of the family that fits the bytes best.

    None if the present one fits, and for a device server.
    """
    came, due = sight.heard.compared
    if not came or not due or same_speed(sight) or not isinstance(sight.link, SerialLink):
        return None
    known = sight.profile.data.link.bauds if sight.profile is not None else ()
    wanted = sight.link.baud * due / came
    others = [baud for baud in known or USUAL_BAUDS if baud != sight.link.baud]
    return min(others, key=lambda baud: abs(log(baud / wanted)), default=None)


LATER = frozenset({5, 6})
"""Exceptions that postpone a request."""
NOT_KNOWN = frozenset({1, 2, 3})
"""Exceptions that reject the function, the register or the value."""
NAME_A_FAMILY = "Name the drive's profile: then the advice of its manual is shown here."


def find_adapter(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the adapter of the port now has another port number."""
    if sight.adapter.now:
        yield f"Open {sight.adapter.now}, or {sight.adapter.was}, which no replugging changes."
    else:
        yield f"Plug the adapter in again; {sight.adapter.was} leads to it wherever it is."
    if sight.changed:
        yield from accept_change(sight)


def accept_change(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the line answers, but differs from the stored one."""
    yield "Nothing but a stop is written meanwhile. If it is right, accept the line as it is now."


def plug_in(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the port does not exist."""
    ports = sight.trouble.ports if isinstance(sight.trouble, PortMissing) else ()
    yield f"Ports found: {', '.join(ports)}." if ports else "No serial port was found."
    if sight.adapter.was:
        yield f"It was {sight.adapter.was}: that one is not plugged in."
    yield "Plug the adapter in; dmesg shows if the system has detected it."


def get_permission(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the user may not open the port."""
    port = sight.port
    group, user = (port.group, port.user) if port is not None else ("", "")
    if port is not None and port.in_group:
        yield f"Log out and in again: then {user} is in {group}."
        return
    if port is not None and not group:
        yield (
            f"sudo chmod g+rw {port.path} lets its group use it until it is plugged in again; a"
            " rule"
            " for udev gives it to a group for good (60-drivepanel.rules has one)."
        )
        return
    yield f"sudo usermod -a -G {group or 'dialout'} {user or '$USER'}, then log in again."


def free_port(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if another program uses the port."""
    if sight.owner_frozen:
        yield "Let that program go on, or end it: kill -9 and its pid. Then the line is free."
        return
    yield "Close that program. Programs of Drive Panel share a line by themselves, others do not."


def other_port(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the port cannot be opened with the required settings."""
    yield "Try another adapter, or another baud and format: serial:PATH,BAUD,FORMAT."


def reach_line(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the line was lost, or the host is unreachable."""
    if isinstance(sight.link, SerialLink):
        yield "Check the adapter's plug; the line reopens automatically."
        return
    yield "Check the gateway's supply and cable, its address, and the port that it listens on."


def wait(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if polling of the drive is paused on purpose."""
    yield "Ask again when that is over."


def hurry_adapter(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the adapter delays received bytes."""
    name = os.path.basename(os.path.realpath(sight.path))
    yield f"echo 1 | sudo tee /sys/bus/usb-serial/devices/{name}/latency_timer"
    yield "Nothing is wrong with the drive; each request costs that much more."


def mend_settings(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the baud or the format is not the drive's."""
    if hint := speed_hint(sight):
        yield hint
    if (likely := likely_baud(sight)) and isinstance(sight.link, SerialLink):
        yield f"Close the line and open serial:{sight.path},{likely},{sight.link.format}."
    elif same_speed(sight) and (formats := other_formats(sight)):
        names = any_of(formats)
        yield f"Close the line and open it at the same speed with another format: {names}."
    yield from settings_hints(sight)
    if sight.profile is None:
        yield NAME_A_FAMILY
    yield "Bytes without any request: polarization is missing, or another master talks."
    yield from wiring_hints(sight)


def end_silence(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if no device answers: check the drive's address and settings, its port, its wires."""
    if hint := speed_hint(sight):
        yield hint
    if sight.profile is None:
        yield "Is the drive on, and is this its address? Some leave the factory without one."
        yield "Are baud and format those of the drive? Some take new ones at power-up only."
        yield "Are the two wires changed over, the common missing, the ends not terminated?"
        yield NAME_A_FAMILY
        yield from library.factory_notes()
        yield from search(sight)
        return
    hints = [address_hint(sight), *settings_hints(sight)]
    # settings other than the factory settings come first
    yield from hints[1:] + hints[:1] if not as_factory(sight) else hints
    yield from search(sight)
    yield from wiring_hints(sight)


def search(sight: DiagnosticEvidence) -> Iterator[str]:
    """Suggest a search for the drive by Drive Panel."""
    if isinstance(sight.link, SerialLink):
        yield (
            "drivepanel scan, or s on Line, looks for it at other addresses, --all-settings at"
            " other baud rates."
        )
    else:
        yield "drivepanel scan, or s on Line, looks for it at other addresses."


def wait_longer(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the drive or a gateway takes longer than the timeout."""
    yield "Write ,timeout=2 behind the line, seconds up to 30; a gateway may add much."


def end_echo(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the adapter repeats sent bytes, and no device answers."""
    yield "The adapter is right: it hears its own sending, so the wires up to it are not cut."
    yield from end_silence(sight)


def end_damage(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if replies arrive damaged."""
    if sight.broken:
        yield "A format that differs by its parity or stop bits breaks some characters only."
        yield from settings_hints(sight)
    yield "Check shield and routing, polarization, termination at both ends only, taps."
    yield "Two drives at one address, or a second master, break answers too."
    yield from wiring_hints(sight, answers=True)


def sort_addresses(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if another address answers."""
    others = ", ".join(map(str, sight.heard.others))
    yield f"Ask for address {others}; or its answer is late: ,timeout=2 behind the line."
    yield "A gateway may be set to put another address in place of the one asked."
    if hint := address_hint(sight):
        yield hint


def find_second_master(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the drive answers another master's request."""
    yield "Another master on this line asks the same drive: a line has one."
    yield "Or two drives have this address: switch one off and ask again."


def ask_gateway(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the gateway did not reach the drive."""
    if 10 in sight.heard.exceptions:
        yield f"In the gateway: is address {sight.device} routed to its serial side?"
        return
    yield "The way to the gateway is right; look at its serial side."
    yield "Its timeout must be longer than the drive takes; its baud and format the drive's."
    yield from end_silence(sight)


def ask_otherwise(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the drive refuses a read."""
    code = sight.heard.exceptions[-1]
    if code in LATER:
        yield "Line, baud and format are right. Ask again: it, or a gateway before it, is at work."
        return
    if code not in NOT_KNOWN:
        yield "Line, baud and format are right: the drive, or a gateway before it, has a trouble."
        return
    yield "Line, baud and format are right: only what was asked is not known there."
    name = sight.profile.name if sight.profile is not None else ""
    yield f"Is it of the family {name}?" if name else NAME_A_FAMILY
    if sight.profile is not None and sight.profile.data.addresses.servers:
        others = ", ".join(server.name for server in sight.profile.data.addresses.servers)
        yield f"Other servers in the same drive have addresses of their own: {others}."


def one_master(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if another master uses the line."""
    if details := sight.overheard.partition(". ")[2]:
        yield details
    yield "Stop the other master, or join it: a line has one. drivepanel listen shows what it asks."


def find_sender(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if bytes arrived before the first request, but no frame."""
    yield "Run drivepanel listen: a master sends again and again, noise at random."
    yield "Check the polarization: without it, an idle line picks up noise."
    yield from wiring_hints(sight)


def open_what_works(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the gateway uses another protocol."""
    assert sight.works is not None
    yield f"Close the line and open {sight.works.line}, or set the gateway to Modbus TCP."


def set_unit(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the gateway answers one unit only."""
    assert sight.works is not None
    yield f"Close the line and open {sight.works.line}. The only drive is device 1 there."
    yield (
        "If the gateway has more than one drive, set it to pass the unit on to the serial side: "
        f"address {sight.device}."
    )


def restart_converter(_sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the converter is one reply behind."""
    yield "Do not use this line: each value shown may be that of another register."
    yield "Restart the converter; set its receive timeout longer than the drive takes to reply."


def part_drives(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if two drives have one address."""
    yield f"Switch one of the drives at address {sight.device} off, and give the other its own."


def swap_bytes(_sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if bytes are swapped on the way."""
    yield "Send no command and no setting: in the gateway, switch the swapping of bytes off."


def keep_connection(_sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if the gateway closes idle connections."""
    yield "Set the idle timeout of the gateway longer, or switch it off."


def find_losses(_sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if replies are missing."""
    yield "Check the wires, their ends and the supply of the drive. Write ,timeout=2 after LINE."
    yield "Other work of the drive or gateway, or another master, makes it miss requests too."


def end_copies(_sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if replies arrive twice."""
    yield "Check adapter, repeater and gateway: one of them sends each frame again."
    yield "Switch the drive off and run why again: a reply shows a second drive at its address."


def end_strays(sight: DiagnosticEvidence) -> Iterator[str]:
    """Steps if bytes without a frame arrive beside intact replies."""
    yield "Check polarization, and termination at both ends only: an idle line picks up noise."
    yield from wiring_hints(sight, answers=True)


SICK_STEPS = {
    "late": wait_longer,
    "lost": find_losses,
    "checksum": end_damage,
    "duplicated": end_copies,
    "other-address": find_second_master,
    "gateway": ask_gateway,
    "two-drives": part_drives,
    "stray-bytes": end_strays,
}
"""Next steps by the verdict on many reads."""
