"""The LINEs of a service: names resolved, with the drives and profiles configured for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import click

from .line_argument import named_line_of
from .several_lines import split_addresses


@dataclass(frozen=True, slots=True)
class ServedLine:
    """One line, and its configuration on the command line and in the settings file."""

    name: str
    """As it was typed first, without addresses."""
    text: str
    """The line, written out."""
    devices: tuple[int, ...] = ()
    """The drives that are named."""
    profiles: Mapping[int, str] = field(default_factory=dict)
    """By device, those that are named."""
    usual_profile: str | None = None
    """The profile of its name: its baud and format count where the line names none."""

    def with_drives(self, devices: Sequence[int], profiles: Mapping[int, str]) -> ServedLine:
        """The same with further drives."""
        every = tuple(dict.fromkeys((*self.devices, *devices)))
        return replace(self, devices=every, profiles={**self.profiles, **profiles})


def served_lines(words: Sequence[str]) -> list[ServedLine]:
    """The lines that are meant; `LINE@1,2` names drives, and so does a name of the settings file.

    Two names of one line, with their drives, are one. Raises UsageError, and LinkSyntaxError for an
    invalid address.
    """
    from tui.session.connect.line_key import line_key

    found: dict[str, ServedLine] = {}
    for word in words:
        made = _served(word)
        key = line_key(made.text)
        before = found.get(key)
        if before is not None and not (before.devices and made.devices):
            raise click.UsageError("A line is named twice.")
        found[key] = before.with_drives(made.devices, made.profiles) if before else made
    return list(found.values())


def _served(word: str) -> ServedLine:
    from tui.session.connect.addresses import parse_addresses
    from tui.session.connect.line_key import line_key
    from tui.session.connect.named_lines import profiles_of_line

    name, addresses = split_addresses(word)
    named = named_line_of(name)
    if named is None:
        devices = tuple(parse_addresses(addresses)) if addresses else ()
        return ServedLine(name, name, devices, profiles_of_line(line_key(name)))
    own = (named.device,) if named.device is not None else ()
    devices = tuple(parse_addresses(addresses)) if addresses else own
    profiles = profiles_of_line(line_key(named.line))
    if named.profile and not own:
        # it is that of the drives which are named with it
        profiles = dict.fromkeys(devices, named.profile) | profiles
    return ServedLine(named.name, named.line, devices, profiles, named.profile)
