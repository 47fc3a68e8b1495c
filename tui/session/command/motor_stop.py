"""One stop of one drive: its word is selected by the state, sent, and followed to standstill."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from tui.bus.api import Priority
from tui.bus.errors import ChecksumFault, ExchangeError, NoAnswer, WrongReply
from tui.drive.chart import state_of
from tui.drive.orders import (
    OrderRefused,
    chart_in_force,
    choose,
    last_word,
    nearest_stop,
    order_target,
    stop_conditions,
    stop_in_any,
    with_options,
)
from tui.drive.profile.schema import Chart, Order, OrderId
from tui.drive.profile.stop_profile import StopProfile
from tui.drive.words import raw_of_word
from tui.safety import STATE_FRESH, STOP_FOLLOWED_FOR, TAKES_EFFECT

from ..connect.limits import limits_of
from ..drive import DriveSession
from ..read.order_check import check_byte_order
from ..read.reader import Reader
from ..reading import Reading
from ..settings.write import Writer
from .first_stop import stop_first, unlike_families
from .last_known import last_known_stop, run_by_others
from .stop_report import MAY_COAST, Phase, not_proved, not_stopped

log = logging.getLogger(__name__)

DOES_NOT_ANSWER = "device {device} does not answer. The stop is repeated."
STILL_TURNS = "it still turns after a minute."
STANDSTILL_UNKNOWN = "it may still turn after a minute: its output frequency was not read."
STANDING = frozenset({"starting", "blocked", "ready", "stopped", "stopping", "fault"})
"""Kinds of state in which a motor at 0 Hz is not enabled, and so is stopped."""

STANDSTILL_POLL_INTERVAL = 0.15

SILENT_WAIT = 0.1
"""Seconds that a drive which was silent before has to answer the first of several stops."""

STILL_ENABLED = {
    "local": "it is at 0 Hz and still enabled from its terminals or keypad: a reference turns it at"
    " once.",
    "channel": "it is at 0 Hz and still enabled {channel}: a reference turns it at once.",
    "unknown": "it is at 0 Hz and still enabled by another source: a reference turns it at once.",
}
RUNS_ON = {
    "local": "it answers and runs on; it is commanded from its terminals or keypad.",
    "channel": "it answers and runs on; it is commanded {channel}.",
    "unknown": "it answers and runs on; it is commanded by another source.",
}
"""Why a motor does not stop, by the source of its commands."""


def with_other_way(progress: str, wanted: OrderId, order: OrderId) -> str:
    """Return a progress with the kind of stop that was requested, if the drive lacks it."""
    if order == wanted:
        return progress
    return f"{progress} (it has no {_way(wanted)}: {_way(order)})"


def _way(order: OrderId) -> str:
    return "ramp stop" if order == "stop" else order.replace("-", " ")


TellStop = Callable[[DriveSession, Phase, str, float], None]


@dataclass(slots=True)
class MotorStop:
    """One stop of one drive, in the line's loop."""

    session: DriveSession
    writer: Writer
    order: OrderId
    ordered: float
    say: TellStop
    wanted: OrderId = field(init=False)
    """The way to stop that was requested; `order` may become the nearest one that exists."""
    wave: FirstWave | None = None
    """Set if several drives are stopped: each is sent a word before any of them is read."""
    begun: bool = False
    sent: bool = False
    """True if its words were sent."""
    taken: bool = False
    """True if the drive has acknowledged them."""
    over: bool = False
    """True if it has ended, or another stop has replaced it."""
    answered: tuple[str, list[int]] | None = None
    """Register and words that the drive has acknowledged."""
    reader: Reader = field(init=False)
    held: dict[str, Reading] = field(default_factory=dict)
    """Command words before the stop, because their option bits are kept."""
    _unheeded: bool = False
    _turned: bool | None = field(init=False)
    """True if the last known frequency before the stop is not 0; None if it is not known."""

    def __post_init__(self) -> None:
        self.reader = Reader(self.session)
        self.wanted = self.order
        frequency = self.session.profile.quantity("output_frequency")
        held = self.session.image.get(frequency.code) if frequency else None
        self._turned = None if held is None or held.raw is None else held.raw != 0

    async def carry_out(self) -> str | None:
        """Select the words, send them, and follow the motor; return why it does not stop."""
        self.begun = True
        if families := unlike_families(self.session):
            return await self._stop_any(families)
        if self.wave is not None and not self.sent:
            try:
                await self._send_at_once()
            finally:
                self.wave.passed(self.session.device)
            await self.wave.over()
        chart, chosen = await self._chosen()
        if self.answered != self._target(chart, chosen):
            await self._send(chart, chosen)
        self.answered = None  # another attempt sends the words again
        return await self._follow(chart, chosen)

    async def _stop_any(self, families: Sequence[StopProfile]) -> str | None:
        """Send the word that stops every candidate family; no profile can follow the motor then."""
        session, ids = self.session, [family.id for family in families]
        try:
            first = await stop_first(
                session.line, session.device, self.writer.journal, families, ids, self.order
            )
        finally:
            session.line.describe(session.device, limits_of(session.profile))
            if self.wave is not None:
                self.wave.passed(session.device)
        self.sent = bool(first.sent)
        self._mark_commanded()
        if first.taken is None:
            return "it took no stop word." if first.answered else "it did not answer."
        session.image.distrust()
        self.taken = True
        self._tell(Phase.FAILED, not_proved())
        return None

    async def follow(self) -> str | None:
        """Follow a motor whose stop was sent in another way; return why it does not stop."""
        self.begun = self.sent = True
        if unlike_families(self.session):
            self._tell(Phase.FAILED, not_proved())
            return None
        return await self._follow(*await self._chosen())

    async def _send_at_once(self) -> None:
        """Send the word for the last known state; do not wait for a drive that is silent.

        The values that are read afterwards decide if another word follows.
        """
        session = self.session
        try:
            chart, order = last_known_stop(session, self.order)
        except OrderRefused:
            return  # the next read selects the word
        silent = session.line.device_state(session.device).answers is False
        try:
            await self._send(chart, order, within=SILENT_WAIT if silent else None)
        except ExchangeError as failure:
            log.warning("first stop frame of device %s: %s", session.device, failure)

    def _target(self, chart: Chart, order: Order) -> tuple[str, list[int]]:
        return order_target(self.session.profile, chart, order).code, list(order.words)

    async def _chosen(self) -> tuple[Chart, Order]:
        """Return the words that stop this drive; read what selects them if it may have changed."""
        profile = self.session.profile
        deciding = [chart.when.parameter for chart in profile.data.charts if chart.when]
        try:
            await self._read_anew(deciding)
            chart = chart_in_force(profile, self._sure(deciding))
            if chart is not None:
                self.order = nearest_stop(chart, self.order)
                await self._read_anew(stop_conditions(chart, self.order))
        except ExchangeError as failure:
            # not read: a word that stops the drive in every state
            log.warning("stop of device %s without a read: %s", self.session.device, failure)
            known = self._sure(deciding)
            chart = chart_in_force(profile, known)
            if chart is None:
                return stop_in_any(profile, known)
        if chart is None:
            return stop_in_any(profile, {})
        return chart, choose(chart, self.order, self._sure(stop_conditions(chart, self.order)))

    async def _read_anew(self, codes: Iterable[str]) -> None:
        wanted = list(dict.fromkeys(codes))
        unsure = [code for code in wanted if code not in self._sure(wanted)]
        if unsure:
            await self.reader.read(unsure, priority=Priority.STOP)

    def _sure(self, codes: Iterable[str]) -> dict[str, int]:
        """Return the values that are certain: just read, or unchangeable while the motor runs."""
        session, image = self.session, self.session.image
        fresh, trusted = image.fresh(STATE_FRESH), image.trusted
        turns = session.state(STATE_FRESH).motion in ("running", "stopping")
        found = {}
        for code in codes:
            held = image.get(code)
            if code not in trusted or held is None:
                continue
            since = session.profile[code].access == "rw-stopped" and held.time > session.rest_seen
            if code in fresh or (turns and since):
                found[code] = trusted[code]
        return found

    async def _send(self, chart: Chart, order: Order, within: float | None = None) -> None:
        session = self.session
        if why := run_by_others(session):
            self._tell_unheeded(why)
        parameter = order_target(session.profile, chart, order)
        if (held := session.image.get(parameter.code)) is not None:
            self.held[parameter.code] = held
        kept = {code: reading.raw for code, reading in self.held.items() if reading.raw is not None}
        self._mark_commanded()
        for word in with_options(chart, order, kept):
            raw = raw_of_word(parameter, word)
            why = f"stopped: {order.name}"
            try:
                await self.writer.write_parameter(
                    parameter, raw, why=why, priority=Priority.STOP, read_back=False, within=within
                )
            except ExchangeError:
                self._tell_sent(order)
                raise
        self.answered, self.taken = self._target(chart, order), True
        self._tell_sent(order)

    def _mark_commanded(self) -> None:
        self.session.reported_by_line = True

    def _tell_sent(self, order: Order) -> None:
        """Report that the words were sent, unless another source is known to run the motor."""
        self.sent = True
        if not self._unheeded:
            self._tell(Phase.STOPPING, order.name)

    def tell_silent(self) -> None:
        """Report a drive that has answered nothing for a while: its stop is still repeated."""
        session, clock = self.session, self.session.clock
        heard = session.line.device_state(session.device).heard
        since = self.ordered if heard is None else max(self.ordered, clock.line_time(heard))
        if clock.monotonic() - since > TAKES_EFFECT:
            self._tell_unheeded(DOES_NOT_ANSWER.format(device=session.device))

    def _tell(self, phase: Phase, text: str) -> None:
        """Report progress, unless another stop has replaced this one and reports its own."""
        if not self.over:
            self.say(self.session, phase, text, self.ordered)

    def _tell_unheeded(self, why: str) -> None:
        self._unheeded = True
        self._tell(Phase.UNHEEDED, not_stopped(why))

    async def _follow(self, chart: Chart, order: Order) -> str | None:
        """Follow the motor to standstill; return why it does not stop, or None."""
        with suppress(NoAnswer, ChecksumFault, WrongReply):  # BytesSwapped ends it: values are void
            await check_byte_order(self.reader, Priority.OPERATOR_READ)
        progress, before, unknown = self.session.clock.monotonic(), None, False
        ending = last_word(chart, order)
        while (now := self.session.clock.monotonic()) - self.ordered < STOP_FOLLOWED_FOR:
            kind, hertz = await self._motion(chart)
            unknown = hertz is None
            # a motor that slows down with an unknown frequency is not known to stand
            if not hertz and kind in STANDING and (hertz == 0 or kind != "stopping"):
                self._tell_standing(kind, before)
                self.session.request_full_read()
                return None
            if hertz == 0 and kind == "running" and ending is not None:
                # at 0 Hz, and still enabled by the word that has stopped it
                await self._send(chart, ending)
                progress, ending = self.session.clock.monotonic(), None
                continue
            slows = hertz is not None and before is not None and hertz < before
            if kind != "running" or slows:
                progress = now
            if now - progress > TAKES_EFFECT:
                return self._why_not(hertz)
            # another source may only have slowed it down: the state decides if it is stopped
            why = run_by_others(self.session) if kind == "running" else ""
            before = hertz
            if why:
                self._tell_unheeded(why)
                await self.session.clock.sleep(STANDSTILL_POLL_INTERVAL)
                continue
            self._unheeded = False
            what = f"{order.name}, {hertz:g} Hz" if hertz else order.name
            self._tell(Phase.STOPPING, self._with_way(what))
            await self.session.clock.sleep(STANDSTILL_POLL_INTERVAL)
        return STANDSTILL_UNKNOWN if unknown else STILL_TURNS

    def _tell_standing(self, kind: str, before: float | None) -> None:
        """Report standstill; with a guessed profile, the values prove nothing.

        `before` is the frequency in Hz at the read before, None if the first read is this one.
        """
        session = self.session
        if session.guessed:
            self._tell(Phase.FAILED, not_proved(session.profile.name))
        else:
            turned = self._turned if before is None else before != 0
            # not known: it may turn when it is left to coast; a fault may be an old one
            coasts = (
                turned is not False if self.order == "freewheel" else kind == "fault" and turned
            )
            text = MAY_COAST if coasts else "stopped"
            self._tell(Phase.STOPPED, self._with_way(text))

    def _with_way(self, progress: str) -> str:
        return with_other_way(progress, self.wanted, self.order)

    def _why_not(self, hertz: float | None) -> str:
        """Return why a drive that does not obey is still enabled."""
        state = self.session.state(STATE_FRESH)
        if hertz != 0 and (why := run_by_others(self.session)):
            return why
        texts = STILL_ENABLED if hertz == 0 else RUNS_ON
        if state.local:
            return texts["local"]
        return texts["channel" if state.channel else "unknown"].format(channel=state.channel)

    async def _motion(self, chart: Chart) -> tuple[str, float | None]:
        """Read the kind of state, and the output frequency in Hz; None if it is not known."""
        session = self.session
        frequency = session.profile.quantity("output_frequency")
        # also the command word: the next one keeps its option bits
        codes = [
            *chart.status_codes,
            *(code for code in self.held if self.session.image.get(code) is None),
        ]
        if frequency is not None:
            codes.append(frequency.code)
        readings = await self.reader.read(codes, priority=Priority.OPERATOR_READ)
        number = readings[frequency.code].number if frequency else None
        read = {code: readings[code].raw for code in chart.status_codes}
        raws = {code: raw for code, raw in read.items() if raw is not None}
        kind = state_of(chart, raws).kind
        return kind, abs(number) if number is not None else None


WAVE_TAKES = 10.0
"""Seconds after which a first wave ends, even if a drive was not sent its frame."""


class FirstWave:
    """First frames of several stops; used in the line's loop only."""

    def __init__(self, devices: Iterable[int]) -> None:
        self._left = set(devices)
        self._over = asyncio.Event()

    def passed(self, device: int) -> None:
        """Note that the frame of a drive was sent, or cannot be."""
        self._left.discard(device)
        if not self._left:
            self._over.set()

    async def over(self) -> None:
        """Wait until all were sent, because reads would delay the next frame."""
        with suppress(TimeoutError):
            async with asyncio.timeout(WAVE_TAKES):
                await self._over.wait()
