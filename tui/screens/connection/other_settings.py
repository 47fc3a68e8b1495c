"""The search at other baud rates and formats, where nobody answers at those of the line."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import TYPE_CHECKING

from textual import work
from textual.worker import WorkerError

from tui.bus.errors import LineError, LinkSyntaxError, PortRefused

from .line_keys import LineKeys
from .state import ALARM_KIND

if TYPE_CHECKING:
    from tui.bus.link import SerialLink
    from tui.drive.finding import LineSetting


class OtherSettings(LineKeys):
    """Tries one setting after the other until a drive answers; the line stays there."""

    _settings_tried: frozenset[LineSetting] = frozenset()
    """Those of the search before, which the next one leaves out."""

    @work(exclusive=True, group="line", exit_on_error=False)
    async def action_scan_settings(self) -> None:
        """Search at every setting that drives can have, likely ones first.

        It ends at the first at which a drive answers, and goes on from there when it is asked for
        once more. No drive that would act is left alone for it unasked.
        """
        if (link := self._port()) is None:
            return
        try:
            devices = self.form.addresses()
        except LinkSyntaxError as error:
            self.say(str(error), "c changes the addresses.", ALARM_KIND)
            return
        self.end_search()
        always = self._what_is_here() if self.found else ""
        question = "Try other baud rates and formats?"
        if not await self.app.may_let_go(question, yes="tries them", no="stays", always=always):
            return
        if not await self.hears_another_master(link):
            await self._try(link, devices, await asyncio.to_thread(self._worth_a_try, link))

    def _port(self) -> SerialLink | None:
        """The port that is open for the panel alone; else it is said why nothing is tried."""
        from tui.bus.link import SerialLink

        opened = self.app.opened
        link = opened.line.link if opened is not None else None
        if opened is None:
            self.say("No line is open.", "Choose one and press Enter.", ALARM_KIND)
        elif not isinstance(link, SerialLink) or opened.simulation is not None:
            self.say("This line has no baud or format of its own.", "s searches it.", ALARM_KIND)
        elif others := opened.line.facts.others:
            who = ", ".join(one.text for one in others)
            next_step = "Other settings need the line for the panel alone."
            self.say(f"{who} uses the line too.", next_step, ALARM_KIND)
        else:
            return link
        return None

    def _worth_a_try(self, link: SerialLink) -> list[LineSetting]:
        """The settings that are left, likely ones first; all of them where none is left."""
        from tui.bus.transport.ports import is_pseudo_terminal
        from tui.drive.finding import LineSetting
        from tui.session.connect.strangers import settings_worth_a_try

        here = LineSetting(link.baud, link.format)
        known = settings_worth_a_try(here, parity=not is_pseudo_terminal(link.path))
        left = [one for one in known[1:] if one not in self._settings_tried]
        if not left:
            self._settings_tried = frozenset()
        self._settings_tried |= {here}
        return left or known[1:]

    async def _try(
        self, link: SerialLink, devices: Sequence[int], settings: Sequence[LineSetting]
    ) -> None:
        """Search at each setting until somebody answers."""
        self.forget_drives()
        for number, setting in enumerate(settings, start=1):
            text = f"serial:{link.path},{setting.baud},{setting.format}"
            far = f"{setting}, {number} of {len(settings)} settings"
            self.advise(f"Drives are searched for at {far}.", "Esc ends it.")
            try:
                await self.app.connect(text, remember=False)
                await self.scan(devices, once=True).wait()
            except WorkerError:
                self.say(f"The search is ended at {far}.", "")
                return
            except PortRefused as error:
                self.app.events.add("told", f"{setting} is not tried: {error}")
                continue
            except LineError as error:
                self.fail(error)
                return
            if self.search is None or self.search.ended != "done":
                return  # told where it failed
            self._settings_tried |= {setting}
            if self.found:
                self._stay_at(text, setting)
                return
        self.say(
            f"No drive answered at any of {len(settings)} settings.",
            "Check that the drives are on, and the two wires; c changes the addresses.",
            ALARM_KIND,
        )

    def _stay_at(self, text: str, setting: LineSetting) -> None:
        """Drives answered: the line stays as it is, and is remembered so."""
        from tui.session.connect.known_lines import remembered_text
        from tui.session.paths import remember_line

        self.form.show_settings(setting.baud, setting.format)
        self.say(f"Drives answer at {setting}.", "The line stays there.")
        remember_line(remembered_text(text))
        self.action_refresh_lines()
        self.look()
