"""Results of written edits, the edits that remain, and changes of the line settings."""

from __future__ import annotations

from collections.abc import Callable, Iterable
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
    SENT = "sent, line settings changed"
    CHANGED = "not written, changed by another source"
    NOT_TAKEN = "not accepted"
    DRIVE_REFUSED = "refused by the drive"
    REFUSED = "not written"
    UNKNOWN = "may have been written"
    NOT_SENT = "not sent"
    HELD_BACK = "not written, depends on another"
    WAITS = "waiting for confirmation"


@dataclass(frozen=True, slots=True)
class Result:
    """One edit with its outcome, a sentence for a person, and the raw value that is held."""

    edit: Edit
    outcome: EditOutcome
    text: str
    held: int | None = None
    voided: bool = False
    """True if it was not sent because of a stop or the end of arming."""
    unchanged: bool = False
    """True if nothing was sent, because the drive already held the value."""
    is_beyond_limit: bool = False
    """True if the value contradicts a limit that another setting has."""

    @property
    def done(self) -> bool:
        """True if the drive has the new value, as far as that can be seen."""
        return self.outcome in (EditOutcome.DONE, EditOutcome.SENT)


@dataclass(frozen=True, slots=True)
class Applied:
    """Result of all edits."""

    results: tuple[Result, ...]
    left: Edits
    """Edits that stay staged, compared with the current values of the drive."""
    links: tuple[LinkChange, ...] = ()
    """Changes of the line settings, in effect now or after a reset."""
    after_reset: tuple[str, ...] = ()
    """Codes whose new value takes effect only after a reset of the drive."""
    unsaved: tuple[str, ...] = ()
    """Codes whose new value is lost at power-off until the drive saves it."""
    stopped: str = ""
    """Why the rest was not written; empty if all were tried."""
    stamp: int = 0
    """Stop count with which they were written: a stop since cancels what waits."""
    waits: tuple[str, ...] = ()
    """Codes that a person may still write after an earlier one has failed."""

    @property
    def unknown(self) -> bool:
        """True if an edit may have been written: its reply or its read-back is missing."""
        return any(result.outcome is EditOutcome.UNKNOWN for result in self.results)

    @property
    def written(self) -> tuple[Result, ...]:
        """The edits that the drive holds now."""
        return tuple(result for result in self.results if result.done)


def done_text(done: Iterable[Result], *, seen: bool = True) -> str:
    """Return how many of these edits were written, only sent, or already held; empty if none.

    Without `seen` they were read back, but not all were seen again at the end.
    """
    results = list(done)
    unchanged = sum(result.unchanged for result in results)
    sent = sum(result.outcome is EditOutcome.SENT for result in results)
    written = len(results) - sent - unchanged
    wrote = f"Wrote {written}, all verified." if seen else f"Wrote {written}."
    parts = [wrote] if written else []
    parts += [f"Sent {sent}, not verified."] if sent else []
    parts += [f"Already held: {unchanged}."] if unchanged else []
    return " ".join(parts)


WriteProgress = Callable[[int, int, Result], None]
"""Called after each edit with the number of finished edits, the number of all, and the result."""


@dataclass(frozen=True, slots=True)
class LinkChange:
    """New line settings of the drive, of one edit."""

    code: str
    role: str
    value: str
    """The new value with its unit or name."""
    device: int
    """The address at which the drive will answer; 0 if its server is switched off."""
    line: str
    """The LINE to type then; unchanged if the setting may belong to another port."""
    at_once: bool
    """True if it takes effect immediately, False if after a reset of the drive."""

    @property
    def text(self) -> str:
        """The effect, and the next step, for a person."""
        return _LINK_TEXTS[self.at_once, bool(self.device)].format(change=self)


_LINK_TEXTS = {
    (True, False): "From now on, the drive does not answer: {change.code} = {change.value} switches"
    " its Modbus server off.",
    (False, False): "After its next reset, the drive does not answer: {change.code} ="
    " {change.value} switches its Modbus server off.",
    (True, True): "From now on, the drive answers with {change.code} = {change.value}. Reach it as"
    " {change.line} -d {change.device}. If this line uses another port of the drive, nothing"
    " changes.",
    (False, True): "After its next reset, the drive answers with {change.code} = {change.value}."
    " Reach it as {change.line} -d {change.device}. If this line uses another port of the drive,"
    " nothing changes.",
}
"""By whether it takes effect immediately, and whether the drive still has an address."""


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
    """Return the link with the new settings; for a gateway, which hides its serial settings, the
    old."""
    if not isinstance(link, SerialLink):
        return link
    format_ = choice.format or link.format
    if choice.parity is not None:
        stop = "1" if choice.parity != "N" else link.format[2]
        format_ = f"8{choice.parity}{stop}"
    return replace(link, baud=choice.baud or link.baud, format=format_)
