"""Advice from a family's manuals, by its profile, for a drive that does not answer."""

from __future__ import annotations

from collections.abc import Iterator

from tui.bus.link import SerialLink
from tui.drive.family_page import end_texts
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import LinkSetting
from tui.drive.sentences import all_of, any_of

from .evidence import DiagnosticEvidence

WIRED = ("polarization", "polarisation", "termination")
"""Subjects of line rules to check; older profiles have the second spelling."""
NAMED = "names of"
"""Beginning of the line rule that names the family's wires."""
SPEED_ROLES = ("baud", "format", "parity")
USED_PINS = ("d0", "d1", "common", "rx", "tx", "0 v")
"""Signals that a cable of the line connects; the differential pair first."""
BOTH_WAYS = "Makers call the two wires both ways round: change them over if nothing answers."


def speed_hint(sight: DiagnosticEvidence) -> str:
    """Return a baud or a format of the line that the family lacks; empty if it has them."""
    link, profile = sight.link, sight.profile
    if profile is None or not isinstance(link, SerialLink):
        return ""
    known = profile.data.link
    if known.bauds and link.baud not in known.bauds:
        return (
            f"{link.baud} bit/s does not work on {profile.name}: it has {min(known.bauds)} to"
            f" {max(known.bauds)}."
        )
    if known.formats and link.format not in known.formats:
        return f"{profile.name} has no {link.format}: it has {', '.join(known.formats)}."
    return ""


def address_hint(sight: DiagnosticEvidence) -> str:
    """Return why an address may be wrong: off, a group address, or out of the family's range."""
    if sight.profile is None:
        return ""
    known, device = sight.profile.data.addresses, sight.device
    if known.zero_digit_is_group and "0" in str(device):
        return f"Address {device} calls a group of drives, as it has a digit 0: no drive answers."
    if not known.first <= device <= known.last:
        return f"{sight.profile.name} has addresses {known.first} to {known.last}."
    setting = _code(sight.profile, "address")
    if known.off is not None:
        if known.factory != known.off:
            return f"Address: {setting}. At OFF ({known.off}) it does not answer."
        return (
            f"Address: {setting}. At OFF ({known.off}) it does not answer, and so it leaves the"
            " factory."
        )
    return f"Address: {setting}; it leaves the factory at {known.factory}."


def as_factory(sight: DiagnosticEvidence) -> bool:
    """Return True if the line has the drive's factory settings."""
    profile, link = sight.profile, sight.link
    if profile is None or not isinstance(link, SerialLink):
        return True
    return (link.baud, link.format) == (profile.data.link.baud, profile.data.link.format)


def settings_hints(sight: DiagnosticEvidence) -> Iterator[str]:
    """Compare the drive's factory baud and format with those of the line."""
    profile, link = sight.profile, sight.link
    if profile is None:
        return
    known = profile.data.link
    if known.at_factory:
        yield known.at_factory
    codes = ", ".join(filter(None, (_code(profile, role) for role in SPEED_ROLES)))
    leaves = f"{profile.name} leaves the factory with {known.baud} {known.format} ({codes})."
    if not isinstance(link, SerialLink):
        yield f"The gateway sets baud and format. {leaves}"
    elif as_factory(sight):
        yield f"{leaves} This line has the same baud and format."
    else:
        yield f"{leaves} This line has {link.baud} {link.format}."
    for setting in known.settings:
        if setting.role == "format" and len(setting.choices) == 1:
            port = setting.note.rstrip(".") or setting.parameter
            yield f"{port}: {setting.choices[0].text} only, whatever the other port has."


def wiring_hints(sight: DiagnosticEvidence, *, answers: bool = False) -> Iterator[str]:
    """Polarity, pins, polarization and termination, as the family's manual names them.

    If the drive answers, its wires are correct: nothing on polarity and pins is given.
    """
    if sight.profile is None:
        return
    data = sight.profile.data
    if not answers:
        yield from _wire_hints(sight.profile)
    if data.schematics:  # the first one is the manual's standard
        yield from end_texts(data.schematics[0])
    for rule in data.line_rules:
        subject = rule.subject.casefold()
        if subject in WIRED or subject.endswith(f", {WIRED[-1]}"):
            yield f"{rule.subject}: {rule.rule}"
    for rule in data.line_rules:
        if rule.subject.casefold() == "ports":
            yield rule.rule
    if data.link.note:
        yield data.link.note


def _wire_hints(profile: Profile) -> Iterator[str]:
    if polarity := _polarity(profile):
        yield f"Polarity: {polarity}"
    for connector in profile.data.connectors:
        pins = [
            f"{pin.pin} {pin.signal}"
            for pin in connector.pins
            if pin.signal.casefold().startswith(USED_PINS)
        ]
        if pins:
            yield f"Pins, {connector.name}: {', '.join(pins)}."


def _polarity(profile: Profile) -> str:
    """Return the family's names of the wires, or which of them are inverted; empty if unknown."""
    data = profile.data
    for rule in data.line_rules:
        if rule.subject.casefold().startswith(NAMED):
            return rule.rule
    named = [
        f"{signal.signal} is {', '.join(signal.names.values())}."
        for signal in data.wiring.signals
        if signal.signal.casefold() in USED_PINS[:2]
    ]
    if named:
        return " ".join([*named, BOTH_WAYS])
    turned = {
        pin.signal
        for connector in data.connectors
        for pin in connector.pins
        if pin.note.casefold().startswith("inverted")
    }
    return f"{all_of(sorted(turned))} are the inverted wires. {BOTH_WAYS}" if turned else ""


def _code(profile: Profile, role: str) -> str:
    """Return the drive's parameters for one setting of its line."""
    found: list[LinkSetting] = [s for s in profile.data.link.settings if s.role == role]
    return any_of([*dict.fromkeys(setting.parameter for setting in found)]) if found else ""
