"""A search over the addresses of a line, at one setting or at all that drives can have."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tui.bus.errors import PortRefused
from tui.bus.link import SerialLink, TcpLink
from tui.drive.errors import DriveError
from tui.drive.finding import LineSetting, watching_families
from tui.drive.profile import library
from tui.session.connect.address_prober import known_profiles
from tui.session.connect.search import Search

from ..shared.asking import may_ask, says_yes
from ..shared.errors import REFUSED_HERE, Failure
from ..shared.line_argument import mind_the_drive
from ..shared.pending_timeouts import look_after, timeout_warning
from .scan_telling import Hit, Progress, ScanTelling

if TYPE_CHECKING:
    from tui.session.connect.identify import DriveIdentity, ScanResult
    from tui.session.connect.open_line import OpenLine
    from tui.session.connect.scan_estimate import ScanEstimate
    from tui.session.diagnosis.remarks import LineRemarks
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet

PROGRESS_EVERY = 0.2
OPEN_WITHIN = 5.0
NONE_TRIED = "No other setting is tried"


@dataclass(slots=True)
class Scan:
    """One run of the command; its hits stay, however it ends."""

    opened: OpenLine
    line_text: str
    devices: Sequence[int]
    tell: ScanTelling
    settings: list[LineSetting] = field(default_factory=list)
    """Those to be tried, that of the line first; none over a network."""
    costs: ScanEstimate | None = None
    """Estimate for other settings; None if none is tried."""
    yes: bool = False
    """True if other settings are tried although drives found may react in that time."""
    hits: list[Hit] = field(default_factory=list)
    tried: list[LineSetting] = field(default_factory=list)
    held_back: str = ""
    """Why settings were not tried; empty where all were."""
    done: bool = False
    sessions: list[DriveSession] = field(default_factory=list)
    """With the drives at the present setting of which a profile may be known."""
    unknown: list[int] = field(default_factory=list)
    """The others that answered there."""
    remarks: list[str] = field(default_factory=list)
    """Troubles of the line that the search has shown, a sentence each."""

    async def run(self) -> None:
        """Listen, then search. Raises Failure before anything is sent, and the line's errors."""
        from tui.session.diagnosis.asking import FRAMES_COME_WITHIN
        from tui.session.diagnosis.remarks import LineRemarks

        self.tell.families(watching_families(await asyncio.to_thread(known_profiles)))
        await asyncio.to_thread(_ready_for_hits)
        await self._listen()
        later = self.settings[1:]
        remarks = LineRemarks(self.opened.line)
        goes_on = await self._at_this_setting(remarks, last=not later)
        while later and goes_on:
            await self._tell_slow(later)
            setting = later.pop(0)
            if await self._reopened(setting):
                goes_on = await self._at_this_setting(remarks, last=not later)
        if not self.hits:
            await asyncio.sleep(FRAMES_COME_WITHIN)
        remarks.look()
        self.remarks = remarks.texts
        self.done = True

    async def _listen(self) -> None:
        """Nothing is sent on a line on which another master asks. Raises Failure."""
        from tui.session.connect.other_masters import LISTEN, listen_first

        line = self.opened.line
        if self.opened.simulation is not None or isinstance(line.link, TcpLink):
            return  # other masters cannot be heard there
        if line.facts.others:
            return  # what is said there comes from programs of ours
        self.tell.note(f"Listening for {LISTEN:g} s before the first request.")
        if text := (await listen_first(line, LISTEN)).text:
            raise Failure(f"{text} Nothing was sent.", REFUSED_HERE)

    @property
    def setting(self) -> LineSetting | None:
        """Setting at which the line is open; None over a network."""
        link = self.opened.line.link
        return LineSetting(link.baud, link.format) if isinstance(link, SerialLink) else None

    async def _at_this_setting(self, remarks: LineRemarks, *, last: bool) -> bool:
        """Ask all addresses; whether other settings may be tried, with what is found held on."""
        from tui.session.connect.other_masters import MasterDetector

        if (setting := self.setting) is not None:
            self.tried.append(setting)
        masters = MasterDetector(self.opened.line)

        def look() -> None:
            masters.look()
            remarks.look()

        async with self._held() as fleet:

            async def found(result: ScanResult) -> None:
                await self._take(fleet, result)

            search = Search(
                self._not_known(),
                once=True,
                patient=self.opened.simulation is not None,
                between=look,
            )
            await self._searched(search, asyncio.ensure_future(search.run(fleet.line, found)))
            if last:
                return True
            self.held_back = await self._why_no_other()
            if self.held_back:
                self.tell.note(self.held_back)
            return not self.held_back

    @asynccontextmanager
    async def _held(self) -> AsyncIterator[Fleet]:
        """Keep polling the drives of this setting until the line is left."""
        from tui.session.fleet import Fleet
        from tui.session.journal import Journal

        fleet = Fleet(self.opened.line, Journal())
        self.sessions, self.unknown = [], []
        try:
            yield fleet
        finally:
            fleet.forget()

    def _not_known(self) -> list[int]:
        """The addresses to ask: not those heard already at a setting that this one understands."""
        here = self.setting
        known = {
            hit.identity.device
            for hit in self.hits
            if here is not None and hit.setting is not None and here.hears(hit.setting)
        }
        return [device for device in self.devices if device not in known]

    async def _searched(self, search: Search, work: asyncio.Future[None]) -> None:
        """Report how far a search is until it has ended."""
        try:
            while not work.done():
                await asyncio.wait({work}, timeout=PROGRESS_EVERY)
                self.tell.progress(self._progress(search))
            await work
        finally:
            work.cancel()

    async def _tell_slow(self, later: Sequence[LineSetting]) -> None:
        """Before the first of the slow settings: how long they take, and who can have them."""
        if (
            self.costs is None
            or not later[0].slow
            or any(setting.slow for setting in self.tried[1:])
        ):
            return
        text = await asyncio.to_thread(self.costs.before_slow, later, "Ctrl-C")
        self.tell.slow(later, self.costs.seconds(later), text)

    def _progress(self, search: Search) -> Progress:
        """Return the progress; the slow settings are a step of their own."""
        later, left, found = self.settings[len(self.tried) :], search.left, len(self.hits)
        if self.costs is not None:
            slow = self.setting is not None and self.setting.slow
            later = [setting for setting in later if slow or not setting.slow]
            left += self.costs.seconds(later)
        return Progress(self.setting, search.requested, search.of, found, left, len(later))

    async def _take(self, fleet: Fleet, result: ScanResult) -> None:
        """An address is not silent: report it at once, then keep polling the drive."""
        if result.identity is None or result.error:
            self.unknown.append(result.device)
            self.tell.unclear(self.setting, result)
            if result.identity is not None and fleet.console(result.device) is None:
                fleet.note(result.identity)  # it answers: keep its timeout from running out
            return
        hit = Hit(self.setting, result.identity, result.by)
        self.hits.append(hit)
        self.tell.hit(hit)
        session = await asyncio.to_thread(self._session, result.identity)
        if len(self.tried) < 2:
            mind_the_drive(self.opened, result.device, result.identity)
        if session is None:
            self.unknown.append(result.device)
            fleet.note(result.identity)
            return
        self.sessions.append(session)
        fleet.take(session, guessed=result.identity.profile is None)
        look_after(self.opened, session, self.line_text)

    def _session(self, who: DriveIdentity) -> DriveSession | None:
        """A session by the profile, or the likeliest of several; None where none fits."""
        from tui.session.drive import DriveSession

        named = who.profile or next(iter(who.candidates), None)
        try:
            profile = library.load(named) if named is not None else None
        except DriveError:
            return None
        line = self.opened.line
        return DriveSession(line, who.device, profile, who) if profile is not None else None

    async def _why_no_other(self) -> str:
        """Why no other setting is tried; empty if one may be. Drives found are kept polled."""
        if others := self.opened.line.facts.others:
            return f"{NONE_TRIED}: {others[0].text} uses the line now."
        acting = [text for session in self.sessions if (text := await self._acts(session))]
        acting += [f"Device {number}: its timeout reaction is not known." for number in
                   self.unknown]  # fmt: skip
        if not acting:
            return ""
        reported = "\n".join(acting)
        if not (self.yes or may_ask()):
            why = "polling of these drives would stop. Use --yes to try anyway."
            return f"{NONE_TRIED}: {why}\n{reported}"
        self.tell.note(f"At other settings these drives are not polled.\n{reported}")
        if self.yes or await says_yes("Try the other settings?"):
            return ""
        return f"{NONE_TRIED}."

    async def _acts(self, session: DriveSession) -> str:
        """Return a drive's reaction to lost polling in a sentence; empty for none."""
        from tui.session.monitor.timeout import timeout_now

        await look_after(self.opened, session, self.line_text).learn()
        text = timeout_warning(session, timeout_now(session), self.line_text)
        return text.partition("\n")[0]

    async def _reopened(self, setting: LineSetting) -> bool:
        """Have the line at another setting; False where the port has no such one."""
        from tui.session.connect.open_line import reopen

        self.opened.farewells.clear()  # their reactions were reported before
        try:
            await asyncio.to_thread(
                reopen, self.opened, setting.baud, setting.format, wait=OPEN_WITHIN
            )
        except PortRefused as error:
            self.tell.note(f"{setting} is not tried: {error}")
            self.settings.remove(setting)
            return False
        return True


def _ready_for_hits() -> None:
    """Read and import before the first request what else the first hit would wait for."""
    import tui.session.connect.known_line
    import tui.session.fleet
    import tui.session.journal
    import tui.session.monitor.timeout  # noqa: F401

    library.matching_profiles("-")
