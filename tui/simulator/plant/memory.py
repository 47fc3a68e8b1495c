"""Commands that move a drive's settings between working memory, EEPROM and factory values.

Sources: ATV312 communication variables, CMI and SCS; ATV71 communication parameters guide. A save
and a recall are only accepted while the motor is not supplied.
"""

from __future__ import annotations

from tui.drive.profile.schema import Parameter
from tui.drive.settings.writable import is_setting

from ..body import Body

CMI_FACTORY, CMI_SAVE, CMI_RESTORE = 1 << 0, 1 << 1, 1 << 2
SAVE_TIME = 0.5
LEVEL_3 = 2
CHANNEL_CODES = ("FR1", "CD1", "CHCF", "TCC")
LINE_ROLES = frozenset({"address", "baud", "format", "parity", "protocol", "timeout", "delay"})


class SettingsMemory:
    """Follower of the words that save, recall and restore settings."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._last = 0
        self._level = 0

    def power_up(self) -> None:
        """Start without a pending command."""
        self._last = 0
        self._level = self._body.setting("LAC", 0)

    def written(self, parameter: Parameter) -> None:
        """Process a word that the line wrote."""
        own = self._body.traits.kind == "own"
        if parameter.quantity == "save_settings" and self._body.registers.present(parameter):
            self._save()
            self._body.registers.put(parameter, 0)
        elif own:
            self._declared(parameter)
        elif parameter.quantity == "extended_command_word":
            self._extended(parameter)
        elif self._body.traits.access_levels and parameter.code.casefold() == "lac":
            self._access_level(parameter)
        self._follow(parameter)

    def _declared(self, parameter: Parameter) -> None:
        """Carry out the commands to the memory that a profile of any make declares."""
        memory, raw = self._body.profile.data.memory, self._body.registers.present(parameter)
        if (enter := memory.enter) and (enter.parameter, enter.raw) == (parameter.code, raw):
            self._enter()
        for order, save in ((memory.save, True), (memory.factory, False)):
            if order is None or order.parameter != parameter.code or self._body.turning:
                continue
            if raw != order.raw and not (order.bit and raw & order.raw == order.raw):
                continue
            if save:
                self._enter()
                self._save()
            else:
                self._body.registers.to_factory(self._kept())
            if not order.keeps_value:
                self._body.registers.put(parameter, raw & ~order.raw if order.bit else 0)

    def _enter(self) -> None:
        """Put all written settings in force that wait for the entering word."""
        registers = self._body.registers
        for parameter in registers.profile.parameters:
            if parameter.effective == "at-once" and is_setting(registers.profile, parameter):
                registers.put(parameter, registers.present(parameter))

    def _follow(self, source: Parameter) -> None:
        """Set the values whose factory settings depend on this one (HSP after bFr)."""
        registers = self._body.registers
        for parameter in registers.profile.parameters:
            by = parameter.factory_by
            if by is not None and by.parameter == source.code:
                raw = by.raws.get(str(registers.present(source)))
                if raw is not None:
                    registers.put(parameter, raw)

    def _access_level(self, parameter: Parameter) -> None:
        """Set the channels to their factory values at access level L3 (ATV31/312)."""
        level = self._body.registers.present(parameter)
        if level == LEVEL_3 and self._level != LEVEL_3:
            for code in CHANNEL_CODES:
                if channel := self._body.registers.named(code):
                    self._body.registers.make_factory(channel)
        self._level = level

    def _extended(self, parameter: Parameter) -> None:
        word = self._body.registers.present(parameter) & 0xFFFF
        rising = word & ~self._last
        if not self._body.turning:
            if rising & CMI_FACTORY:
                self._body.registers.to_factory(self._kept())
            if rising & CMI_SAVE:
                self._save()
            if rising & CMI_RESTORE and not self._body.traits.access_levels:
                self._body.registers.recall(self._kept())
        shown = word & ~(CMI_FACTORY | CMI_SAVE)
        self._body.registers.put(parameter, shown)
        self._last = shown

    def _save(self) -> None:
        if not self._body.turning:
            self._body.registers.save()
            self._body.saving = SAVE_TIME

    def _kept(self) -> frozenset[str]:
        """Return the line settings, which keep their value when others are recalled."""
        settings = self._body.profile.data.link.settings
        return frozenset(s.parameter for s in settings if s.role in LINE_ROLES)
