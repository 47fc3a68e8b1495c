"""Test of a drive's communication timeout by pauses in polling of growing length.

A read restarts the drive's timeout, so one pause cannot be timed: each ends with one read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from tui.bus.api import Priority
from tui.bus.errors import LineLost
from tui.drive.chart import ENABLED_KINDS, fault_code
from tui.drive.errors import DriveError
from tui.drive.orders import OrderRefused, deciding_codes
from tui.drive.profile.schema import CommunicationFault, Reaction
from tui.drive.sentences import all_of

from ..drive import DriveSession
from ..drive_state import DriveState, drive_state
from ..journal import Journal
from ..monitor.timeout import timeout_seconds, timeouts_of_ports
from ..read.reader import Reader
from ..reading import Reading
from ..settings.write import Writer, raw_text
from ..work import Permit
from .result import UNNAMED_FAULT, Bracket, ProofResult, silences

PAUSED_FOR_TEST = "Its communication timeout is being tested: polling is paused."
STOP_CHECK_INTERVAL = 0.05
"""Seconds between two checks, during a pause, for a stop command."""
RECONNECTED_BY_THEN = 10.0
"""Seconds for which a line may be lost after a pause before the test ends."""
REACTION_SHOWS_AFTER = 0.3
"""Seconds after which a drive's reaction shows, before all its words are read."""
SLOWER = 0.8
"""Share of the previous frequency below which a turning motor counts as slowing down."""


class NothingToProve(DriveError):
    """The drive has no communication timeout in force."""


def hidden_at_rest(reaction: Reaction | None) -> str:
    """Return why a reaction does not show at standstill; empty if it shows or is unknown."""
    if reaction is None or reaction.trips:
        return ""
    return (
        f"{reaction.name}: no fault follows, so nothing shows at standstill. Test it with the motor"
        " turning."
    )


def _nothing_runs(rules: CommunicationFault, reported: Mapping[str, Reading]) -> str:
    """Return why there is nothing to test, from the timeout reported for each port."""
    ports = (rules.timeout, *rules.other_timeouts)
    absent = [code for code in ports if code not in reported]
    silent = all_of(absent) if absent else ""
    missing = f"{silent} cannot be read; perhaps this drive does not have it."
    if not reported:
        return f"Not tested: {missing} The reaction to a communication loss is unknown."
    off = all_of([f"{code} is {reading.text}" for code, reading in reported.items()])
    text = f"{off}. The drive does not react to a communication loss: a running motor continues."
    return f"{text} {missing}" if silent else text


_CHANGED = "{code} is {value}; it was {before} when last read."


@dataclass(slots=True)
class Prover:
    """One timeout test of one drive; the callback receives the progress."""

    session: DriveSession
    journal: Journal
    permit: Permit
    turning: bool = False
    report: Callable[[str], None] = lambda _: None
    _reader: Reader = field(init=False)

    def __post_init__(self) -> None:
        self._reader = Reader(self.session)

    async def prove(self) -> ProofResult:
        """Test the communication timeout of the drive.

        Raises NothingToProve, OrderRefused if the drive is not ready for the test, Stopped if a
        stop arrives, and the line's errors. In every case, polling by others resumes afterwards.
        """
        session, facts = self.session, self.session.line.facts
        rules = session.profile.data.communication_fault
        if rules is None or not rules.timeout:
            raise NothingToProve(f"{session.profile.name} has no communication timeout.")
        watch = (rules.timeout, *rules.other_timeouts, rules.reaction)
        before = {code: session.image.get(code) for code in watch if code}
        # before polling is paused: a drive may not answer for a port that it lacks, and the next
        # request must then wait until a late reply can no longer arrive
        readings = await self._settings(rules)
        await self._reader.read(self._state_codes())
        facts.pause_polling(session.device, PAUSED_FOR_TEST)
        try:
            timeout = self._timeout(rules, readings)
            readings |= await self._read(self._codes(rules))
            reaction = self._reaction(rules, readings)
            self._check_fit(drive_state(session.profile, readings), reaction)
            await self._begin_watch(rules)
            changed = self._changed(before, readings)
            result = await self._grow(rules, timeout, reaction, changed)
            await self._check_same(rules, readings)
            return result
        finally:
            facts.resume_polling(session.device)
            session.request_full_read()

    async def _settings(self, rules: CommunicationFault) -> dict[str, Reading]:
        """The timeout of each port that the drive has."""
        reported = await timeouts_of_ports(self._reader, rules, Priority.OPERATOR_READ)
        return {reading.parameter.code: reading for reading in reported if reading.raw is not None}

    @staticmethod
    def _timeout(rules: CommunicationFault, reported: dict[str, Reading]) -> float:
        """The shortest timeout that is not off, in seconds; raises NothingToProve if all are
        off."""
        running = [
            s
            for reading in reported.values()
            if (s := timeout_seconds(reading, rules.off)) is not None
        ]
        if not running:
            raise NothingToProve(_nothing_runs(rules, reported))
        return min(running)

    def _codes(self, rules: CommunicationFault) -> list[str]:
        profile = self.session.profile
        codes = [rules.reaction, *self._state_codes()]
        return [*dict.fromkeys(code for code in codes if code), *deciding_codes(profile)]

    def _state_codes(self) -> list[str]:
        profile = self.session.profile
        codes = [*profile.data.status_codes]
        codes += [chart.when.parameter for chart in profile.data.charts if chart.when]
        codes += [profile.data.faults.parameter, fault_code(profile) or ""]
        frequency = profile.quantity("output_frequency")
        codes.append(frequency.code if frequency else "")
        return list(dict.fromkeys(code for code in codes if code))

    async def _read(self, codes: list[str]) -> dict[str, Reading]:
        # with the priority of a stop: only stops pass while polling is paused
        return await self._reader.read(codes, priority=Priority.STOP)

    @staticmethod
    def _reaction(rules: CommunicationFault, readings: dict[str, Reading]) -> Reaction | None:
        raw = readings[rules.reaction].raw if rules.reaction else None
        return next((reaction for reaction in rules.reactions if reaction.raw == raw), None)

    def _check_fit(self, state: DriveState, reaction: Reaction | None) -> None:
        """Raise OrderRefused if nothing could be tested, or if the motor would do more than
        requested."""
        if state.kind == "fault":
            raise OrderRefused("Not tested: the drive is already in fault. Reset it first.")
        if state.kind == "unknown":
            raise OrderRefused("Not tested: the state of the drive is unknown.")
        turns = state.motion in ENABLED_KINDS
        if turns and not self.turning:
            raise OrderRefused(
                "Not tested: the motor is not at standstill. Stop it first. Or test it turning"
                " (--turning): it may then coast, and a hoist load may fall."
            )
        if self.turning and not turns:
            raise OrderRefused(
                "Not tested: the motor is at standstill. Run it first, or test it at standstill."
            )
        if not self.turning and (why := hidden_at_rest(reaction)):
            raise OrderRefused(why)

    async def _begin_watch(self, rules: CommunicationFault) -> None:
        """Send a command that moves nothing, if the drive's timeout begins with the first
        command."""
        word = rules.begins_with
        chart = self.session.profile.chart(self.session.image.raws)
        if word is None or chart is None or self.turning:
            return
        self.permit.check()
        # no permit: the reads that accompany one would be held, like those of other programs
        writer = Writer(self.session, self.journal, None)
        await writer.write_parameter(
            self.session.profile[chart.command],
            word,
            why="starts communication monitoring, moves nothing",
            read_back=False,
            priority=Priority.STOP,
        )

    async def _check_same(self, rules: CommunicationFault, began: dict[str, Reading]) -> None:
        """Raise OrderRefused if a setting of the drive changed during the test."""
        ports = (rules.timeout, *rules.other_timeouts, rules.reaction)
        now = await self._read([code for code in ports if code and code in began])
        for code in now:
            if now[code].raw != began[code].raw:
                value = f"{now[code].text} {now[code].unit}".rstrip()
                raise OrderRefused(
                    f"The test does not count: {code} changed during it, and is now {value}."
                    " Test again."
                )

    def _changed(self, before: dict[str, Reading | None], readings: dict[str, Reading]) -> str:
        changed = [
            _CHANGED.format(
                code=code,
                value=f"{readings[code].text} {readings[code].unit}".rstrip(),
                before=raw_text(self.session, held.parameter, held.raw),
            )
            for code, held in before.items()
            if held is not None
            and held.raw is not None
            and code in readings
            and held.raw != readings[code].raw
        ]
        return " ".join(changed)

    async def _grow(
        self, rules: CommunicationFault, timeout: float, reaction: Reaction | None, changed: str
    ) -> ProofResult:
        clock, bracket = self.session.clock, Bracket()
        begun = clock.monotonic()  # the drive may have counted from the start of a request on
        readings = await self._read(self._state_codes())
        speed, ended = self._hertz(readings), clock.monotonic()
        for seconds in silences(timeout):
            self.report(f"pause of {seconds:.1f} s; the timeout is {timeout:g} s.")
            await self._silence(ended + seconds)
            requested = clock.monotonic()
            readings = await self._read_after_silence()
            heard = clock.monotonic()
            state = drive_state(self.session.profile, readings)
            seen = self._seen(state, speed, self._hertz(readings))
            if seen:
                # at most from the start of the request before to the end of this one's reply
                bracket = bracket.reacted(heard - begun)
                return await self._result(rules, timeout, reaction, bracket, seen, changed)
            self._check_rest(state)
            bracket = bracket.alive(requested - ended)
            begun, ended = requested, heard
        return await self._result(rules, timeout, reaction, bracket, "", changed)

    async def _read_after_silence(self) -> dict[str, Reading]:
        """Read the state; if a gateway closed the idle connection, read after it reconnects.

        The drive is not read in between, so its pause only becomes longer. Raises LineLost if the
        line stays lost.
        """
        clock = self.session.clock
        limit, reported = clock.monotonic() + RECONNECTED_BY_THEN, False
        while True:
            try:
                return await self._read(self._state_codes())
            except LineLost:
                if clock.monotonic() >= limit:
                    raise
            if not reported:
                self.report("the connection closed during the pause. Waiting until it is open.")
                reported = True
            await self._silence(clock.monotonic() + STOP_CHECK_INTERVAL)

    def _check_rest(self, state: DriveState) -> None:
        """Raise OrderRefused if a motor that was at standstill turns: no person agreed to that."""
        if not self.turning and state.motion in ENABLED_KINDS:
            raise OrderRefused(
                "The motor started to turn. The test has ended, and the drive is polled again."
            )

    async def _silence(self, until: float) -> None:
        clock = self.session.clock
        while (left := until - clock.monotonic()) > 0:
            self.permit.check()
            await clock.sleep(min(left, STOP_CHECK_INTERVAL))
        self.permit.check()

    def _hertz(self, readings: dict[str, Reading]) -> float | None:
        frequency = self.session.profile.quantity("output_frequency")
        number = readings[frequency.code].number if frequency else None
        return None if number is None else abs(number)

    def _seen(self, state: DriveState, before: float | None, now: float | None) -> str:
        """Return the drive's reaction since the last request; empty for none."""
        if state.kind == "fault":
            return "trips"
        if not self.turning:
            return ""
        if state.motion not in ENABLED_KINDS:
            return "stops"
        if state.motion == "stopping" or (before and now is not None and now < SLOWER * before):
            return "slows down"
        return ""

    async def _result(
        self,
        rules: CommunicationFault,
        timeout: float,
        reaction: Reaction | None,
        bracket: Bracket,
        seen: str,
        changed: str,
    ) -> ProofResult:
        profile = self.session.profile
        state = None
        if seen:
            await self.session.clock.sleep(REACTION_SHOWS_AFTER)
            state = drive_state(profile, await self._read(self._state_codes()))
        codes = {code.raw: f"{code.code}, {code.name}" for code in profile.data.faults.codes}
        trips = reaction is None or reaction.trips
        expected = codes.get(rules.fault, "") if trips and rules.fault is not None else ""
        fault = ""
        if state is not None and state.kind == "fault":
            fault = f"{state.fault.code}, {state.fault.name}" if state.fault else UNNAMED_FAULT
        return ProofResult(
            self.session.device, timeout, reaction, bracket, self.turning, seen, fault,
            expected, changed,
        )  # fmt: skip
