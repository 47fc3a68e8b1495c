"""Effect of a written line setting: the settings under which the drive answers."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tui.bus.link import Link, SerialLink, label
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import LinkChoice, LinkSetting
from tui.drive.settings.edits import Edit
from tui.drive.settings.writable import CUTTING, line_setting, waits_for_reset


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
