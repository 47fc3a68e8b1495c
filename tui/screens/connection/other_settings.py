"""Scan at other baud rates and formats, if no drive answers at those of the line."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import TYPE_CHECKING

from textual import work
from textual.worker import WorkerError, get_current_worker

from tui.bus.errors import LineError, LinkSyntaxError, PortRefused

from .advice import ALARM_KIND
from .line_keys import LineKeys

if TYPE_CHECKING:
    from tui.bus.link import SerialLink
    from tui.drive.finding import LineSetting
    from tui.session.connect.scan_estimate import ScanEstimate

DRIVES_ANSWER = "Drives answer at {setting}."
DAMAGED_ANSWERS = "A device answers at {setting}, but its identification is damaged."


class OtherSettings(LineKeys):
    """Tries one setting after another until a drive answers; the line keeps that setting."""

    _settings_tried: frozenset[LineSetting] = frozenset()
    """Settings already tried; the next scan skips them until none is left."""

    @work(exclusive=True, group="line", exit_on_error=False)
    async def action_scan_settings(self) -> None:
        """Scan at every setting that a family can have, likely ones first.

        Ends at the first setting with an answer; the next call continues with the remaining ones.
        Asks first if a device has answered, because its polling stops.
        """
        if (link := self._port()) is None:
            return
        try:
            devices = self.form.addresses()
        except LinkSyntaxError as error:
            self.say(str(error), "Press c to change the addresses.", ALARM_KIND)
            return
        self.end_search()
        always = self._what_is_here() if self.found else self._who_is_unclear()
        question = "Try other baud rates and formats?"
        if not await self.app.may_let_go(question, yes="Scan", no="Cancel", always=always):
            return
        await self.name_families()
        if not await self.hears_another_master(link):
            settings = await asyncio.to_thread(self._worth_a_try, link)
            costs = await asyncio.to_thread(self._costs, link, settings, len(devices))
            await self._try(link, devices, settings, costs)

    def _who_is_unclear(self) -> str:
        """Warn of devices that answered without a valid identification; empty if there are none."""
        from tui.session.connect.addresses import addresses_text

        answered = self.search.answered if self.search is not None else frozenset()
        if not answered:
            return ""
        who = addresses_text(sorted(answered))
        return f"A device answered at {who}. Its communication loss reaction is not known."

    def _port(self) -> SerialLink | None:
        """Return the serial port if only this panel uses it; else show why no setting is tried."""
        from tui.bus.link import SerialLink

        opened = self.app.opened
        link = opened.line.link if opened is not None else None
        if opened is None:
            self.say("No line is open.", "Choose one and press Enter.", ALARM_KIND)
        elif not isinstance(link, SerialLink) or not opened.is_real:
            self.say(
                "This line has no baud or format of its own.", "Press s to scan it.", ALARM_KIND
            )
        elif others := opened.line.facts.others:
            who = ", ".join(other.text for other in others)
            next_step = "Close that program to try other settings."
            self.say(f"{who} also uses the line.", next_step, ALARM_KIND)
        else:
            return link
        return None

    def _worth_a_try(self, link: SerialLink) -> list[LineSetting]:
        """Return the untried settings, likely ones first; reads files.

        If none is left, start over with all but the current one.
        """
        from tui.bus.transport.ports import is_pseudo_terminal
        from tui.drive.finding import LineSetting
        from tui.session.connect.address_prober import settings_worth_a_try

        here = LineSetting(link.baud, link.format)
        known = settings_worth_a_try(here, parity=not is_pseudo_terminal(link.path))
        left = [setting for setting in known[1:] if setting not in self._settings_tried]
        if not left:
            self._settings_tried = frozenset()
        self._settings_tried |= {here}
        return left or known[1:]

    def _costs(
        self, link: SerialLink, settings: Sequence[LineSetting], addresses: int
    ) -> ScanEstimate:
        """Estimate the duration of a scan at these settings; reads files."""
        from tui.session.connect.scan_estimate import scan_estimate

        opened = self.app.opened
        wait = opened.line.timing.scan_timeout if opened is not None else 0.0
        return scan_estimate(link, wait, settings, addresses)

    def _tell_slow(self, settings: Sequence[LineSetting], costs: ScanEstimate) -> None:
        """Report how long the slow settings take, and which families can have them."""
        self.app.events.add("told", costs.before_slow(settings, "Esc"))

    async def _try(
        self,
        link: SerialLink,
        devices: Sequence[int],
        settings: Sequence[LineSetting],
        costs: ScanEstimate,
    ) -> None:
        """Scan at each setting until a device answers; skip settings that the port refuses."""
        self.forget_drives()
        for number, setting in enumerate(settings, start=1):
            text = f"serial:{link.path},{setting.baud},{setting.format}"
            far = f"{setting}, {number} of {len(settings)} settings"
            later = settings[number:]
            if setting.slow and not any(item.slow for item in settings[: number - 1]):
                self._tell_slow((setting, *later), costs)
            self.later = costs.seconds(item for item in later if setting.slow or not item.slow)
            self.advise(f"Scanning at {far}.", "Press Esc to end it.")
            try:
                self.app.opening.begin(text, get_current_worker())
                try:
                    await self.app.connect(text, remember=False)
                finally:
                    self.app.opening.end()
                await self.scan(devices, once=True).wait()
            except WorkerError:
                self.say(f"The scan ended at {far}.", "")
                return
            except PortRefused as error:
                self.app.events.add("told", f"{setting} was skipped: {error}")
                continue
            except LineError as error:
                self.fail(error)
                return
            if self.search is None or self.search.ended != "done":
                return  # the scan has reported why it ended
            self._settings_tried |= {setting}
            if self.found or self.search.answered:
                self._stay_at(text, setting)
                return
        self.say(
            f"No drive answered at any of {len(settings)} settings.",
            "Check that the drives are on, and both wires. Press c to change the addresses.",
            ALARM_KIND,
        )

    def _stay_at(self, text: str, setting: LineSetting) -> None:
        """Keep the line at the setting at which a device answered, and store it as recent."""
        from tui.session.connect.known_lines import remembered_text
        from tui.session.paths import remember_line

        self.form.show_settings(setting.baud, setting.format)
        answer = DRIVES_ANSWER if self.found.keys() - self.unclear else DAMAGED_ANSWERS
        self.say(answer.format(setting=setting), "The line keeps these settings.")
        remember_line(remembered_text(text))
        self.action_refresh_lines()
        self.look()
