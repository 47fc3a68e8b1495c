"""Result of writing staged edits, and the edits that remain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

from tui.bus.link import Link, SerialLink, label
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import LinkChoice, LinkSetting
from tui.drive.settings.edits import Edit, Edits
from tui.drive.settings.writable import CUTTING, line_setting, waits_for_reset


class EditOutcome(StrEnum):
    """Result of one edit."""

    DONE = "done"
    SENT = "sent, line changed"
    CHANGED = "changed meanwhile"
    NOT_TAKEN = "not taken"
    DRIVE_REFUSED = "the drive refused"
    REFUSED = "not written"
    UNKNOWN = "not known"
    NOT_SENT = "not sent"
    HELD_BACK = "held back"
    WAITS = "waits for an answer"


@dataclass(frozen=True, slots=True)
class Result:
    """One edit with its outcome, a sentence for a person, and what the drive holds now."""

    edit: Edit
    outcome: EditOutcome
    text: str
    held: int | None = None
    voided: bool = False
    """True if a stop, or the end of arming, kept it from being sent."""

    @property
    def done(self) -> bool:
        """True if the drive has the new value, as far as that can be seen."""
        return self.outcome in (EditOutcome.DONE, EditOutcome.SENT)


@dataclass(frozen=True, slots=True)
class Applied:
    """Result of all edits."""

    results: tuple[Result, ...]
    left: Edits
    """Edits still staged, against the present values of the drive."""
    links: tuple[LinkChange, ...] = ()
    """Changes of the line itself, now or after a reset."""
    after_reset: tuple[str, ...] = ()
    """Codes whose new value is in force only once the drive was reset."""
    unsaved: tuple[str, ...] = ()
    """Codes whose new value is lost at power-off until the drive is ordered to save."""
    stopped: str = ""
    """Why the rest was not tried; empty where all were."""
    stamp: int = 0
    """The count of stops under which they were written: a stop since voids what waits."""
    waits: tuple[str, ...] = ()
    """Codes that could be written yet, once a person says so: one before them failed."""

    @property
    def written(self) -> tuple[Result, ...]:
        """The edits that the drive has now."""
        return tuple(result for result in self.results if result.done)


WriteProgress = Callable[[int, int, Result], None]
"""Called after each edit with how many are done, how many there are, and the result."""


@dataclass(frozen=True, slots=True)
class LinkChange:
    """New settings of the drive's side of the line."""

    code: str
    role: str
    value: str
    """The new value as a person reads it."""
    device: int
    """The address at which the drive answers then; 0 where its server is switched off."""
    line: str
    """The line as it has to be written then; as now where another port may be meant."""
    at_once: bool
    """False where it comes into force only when the drive is reset."""

    @property
    def text(self) -> str:
        """Effect, and the next step."""
        when = "From now on" if self.at_once else "After its next reset"
        if not self.device:
            return f"{when} the drive's server is off ({self.code} = {self.value})."
        return (
            f"{when} the drive answers with {self.code} = {self.value}: reach it by"
            f" {self.line} -d {self.device}. If this line is on another port of the drive,"
            " nothing changes here."
        )


def link_change(profile: Profile, link: Link, device: int, edit: Edit) -> LinkChange | None:
    """Return the effect of an edit on the line; None if it is not a setting of the line itself."""
    setting = line_setting(profile, edit.code)
    if setting is None or setting.role not in CUTTING:
        return None
    parameter = profile[edit.code]
    choice = _choice(setting, edit.new)
    if setting.role == "address":
        off = profile.data.addresses.off
        device = 0 if edit.new == off or edit.new == 0 else edit.new
    return LinkChange(
        code=edit.code,
        role=setting.role,
        value=edit.text,
        device=device,
        line=label(_changed(link, choice)),
        at_once=not waits_for_reset(profile, parameter),
    )


def _choice(setting: LinkSetting, raw: int) -> LinkChoice:
    return next((c for c in setting.choices if c.raw == raw), LinkChoice(raw=raw, text=str(raw)))


def _changed(link: Link, choice: LinkChoice) -> Link:
    """The link with what the choice says; gateways keep their serial settings to themselves."""
    if not isinstance(link, SerialLink):
        return link
    format_ = choice.format or link.format
    if choice.parity is not None:
        stop = "1" if choice.parity != "N" else link.format[2]
        format_ = f"8{choice.parity}{stop}"
    return replace(link, baud=choice.baud or link.baud, format=format_)
