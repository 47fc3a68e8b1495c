"""Station of a drive on the line: its address, groups, baud and format, and its turnaround."""

from __future__ import annotations

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import LinkChoice, LinkSetting, Parameter

from ..registers import Registers
from ..spec import LineTiming
from .client_settings import ClientSettings

SHORTEST_TURNAROUND = 0.0015
"""Least turnaround in s: PX-MODBUS manual 4, 15.06."""
FORMAT_ROLES = ("baud", "format", "parity")


class Station:
    """Effect of the link settings in force on one drive."""

    def __init__(self, profile: Profile, registers: Registers, address: int) -> None:
        self._profile = profile
        self._registers = registers
        self._given = address
        self._settings: list[tuple[LinkSetting, Parameter]] = []

    def settle(self, timing: LineTiming) -> None:
        """Set the drive to the settings of the line, as far as its choices allow."""
        roles: set[str] = set()
        for setting in self._profile.data.link.settings:
            fitting = [c.raw for c in setting.choices if _fits(c, timing)]
            if setting.role in FORMAT_ROLES and setting.role not in roles and fitting:
                parameter = self._profile[setting.parameter]
                self._registers.settle(parameter, fitting[0])
                self._settings.append((setting, parameter))
                roles.add(setting.role)

    def settle_address(self) -> None:
        """Set the drive's address parameter."""
        if parameter := self._address_parameter():
            self._registers.settle(parameter, self._given)

    def _address_parameter(self) -> Parameter | None:
        for setting in self._profile.data.link.settings:
            if setting.role == "address":
                return self._profile[setting.parameter]
        return self._profile.quantity("line_address")

    @property
    def address(self) -> int:
        """The present address of the drive."""
        parameter = self._address_parameter()
        return self._registers.in_force(parameter) if parameter else self._given

    @property
    def is_group(self) -> bool:
        """True if the drive's own address calls a group, so that it never answers there."""
        return self._profile.data.addresses.zero_digit_is_group and "0" in str(self.address)

    def is_called(self, address: int) -> bool:
        """Return True if a broadcast or group address includes this drive."""
        addresses = self._profile.data.addresses
        if not self.address:
            return False
        if address == addresses.broadcast:
            return True
        return addresses.zero_digit_is_group and in_group(self.address, address)

    @property
    def turnaround(self) -> float:
        """Return the time from the end of a request to the start of the reply, in s."""
        for setting in self._profile.data.link.settings:
            if setting.role == "delay":
                delay = self._registers.in_force(self._profile[setting.parameter])
                return max(delay / 1000, SHORTEST_TURNAROUND)
        return float(self._profile.data.link.turnaround_ms) / 1000

    def hears(self, timing: LineTiming, client: ClientSettings | None = None) -> bool:
        """Return True if the drive's protocol, baud and format in force are those of the line.

        `client` holds the settings of the other side; if visible, they replace those of the line.
        """
        for setting in self._profile.data.link.settings:
            if setting.role == "protocol" and setting.factory is not None:
                protocol = self._registers.in_force(self._profile[setting.parameter])
                if protocol != setting.factory:
                    return False
        choices = self._chosen()
        if client is not None:
            return client.fits(*_own(choices, timing))
        return all(_fits(choice, timing) for choice in choices)

    def own(self, timing: LineTiming) -> LineTiming:
        """Return the timing by the drive's own settings; those of the line if no word of the drive
        sets them."""
        baud, form = _own(self._chosen(), timing)
        return LineTiming(baud, form, timing.real_time)

    def _chosen(self) -> list[LinkChoice]:
        """Return the settings in the drive's words for baud and format, as far as it has any."""
        chosen = []
        for setting, parameter in self._settings:
            raw = self._registers.in_force(parameter)
            chosen += [choice for choice in setting.choices if choice.raw == raw][:1]
        return chosen


def in_group(own: int, called: int) -> bool:
    """Return True if a group address includes an address: a zero digit matches any digit but 0."""
    mine, theirs = str(own), str(called)
    if called == 0 or "0" not in theirs or "0" in mine or len(mine) != len(theirs):
        return False
    return all(t in ("0", m) for m, t in zip(mine, theirs, strict=True))


def _own(choices: list[LinkChoice], timing: LineTiming) -> tuple[int, str]:
    """Return baud and format of a drive; those of the line if no word of the drive sets them."""
    baud, form = timing.baud, timing.format
    for choice in choices:
        baud = choice.baud or baud
        form = choice.format or (f"8{choice.parity}{form[2]}" if choice.parity else form)
    return baud, form


def _fits(choice: LinkChoice, timing: LineTiming) -> bool:
    """Return True if a choice agrees with the line, as far as it defines baud or format."""
    return (
        choice.baud in (None, timing.baud)
        and choice.format in (None, timing.format)
        and choice.parity in (None, timing.format[1])
    )
