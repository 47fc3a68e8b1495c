"""Reading parameters of one drive: plan, exchange, decode. A refusal affects no other word."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from tui.bus.api import ModbusLine, Priority, Reply
from tui.bus.errors import DeviceException, NoAnswer, NotRecorded
from tui.bus.poll_plan import PlannedRead, PolledTurn
from tui.drive.chart import read_chart
from tui.drive.profile.profile import Profile, is_verified
from tui.drive.profile.schema import Block, Parameter
from tui.drive.read_plan import Place, ReadPlan, ReadRequest
from tui.drive.values import from_words, word_count
from tui.safety import SOURCE_AGE

from ..drive import DriveSession
from ..image import NEVER_READ
from ..reading import Origin, Reading
from .decoded import Decoding, sources_of
from .kept_plans import KeptPlans, planned_read, planned_reads
from .presence import look_for_drive, meets_silence
from .slots import Slots

ASK_AGAIN = 30.0
"""Seconds after which a poll reads a refused parameter again."""


@dataclass(slots=True)
class Reader:
    """Reads parameters of one drive into its image.

    Raises the line's errors, and BytesSwapped while the bytes of the drive's words arrive swapped.
    A refusal raises nothing: only the reading of the refused parameter is bad.
    """

    session: DriveSession
    using: str = ""
    """Name of the block or scanner that the last poll read, if it read one."""
    max_age: float = 0.0
    """Age in seconds up to which a poll uses values that another program has read."""
    also: frozenset[str] = frozenset()
    """Codes whose values a poll takes from replies to other reads: they may lie between them."""
    _beside: dict[ReadRequest, tuple[Place, ...]] = field(default_factory=dict)
    """Places of `also` in the reply to a request."""
    _polled: PolledTurn | None = None
    """Replies that the keeper has read for the current poll."""
    _met: set[str] = field(default_factory=set)
    """Unconfirmed words that this drive has answered."""
    _plans: KeptPlans = field(init=False)
    _slots: Slots = field(init=False)

    def __post_init__(self) -> None:
        self._plans = KeptPlans(self.session)
        self._slots = Slots(self.line, self.device, self.profile, self.session.clock)

    @property
    def line(self) -> ModbusLine:
        """The line of the drive."""
        return self.session.line

    @property
    def device(self) -> int:
        """The drive's slave address."""
        return self.session.device

    @property
    def profile(self) -> Profile:
        """Facts about the drive's family."""
        return self.session.profile

    async def read(
        self,
        codes: Iterable[str],
        *,
        priority: Priority = Priority.OPERATOR_READ,
        polled: PolledTurn | None = None,
    ) -> dict[str, Reading]:
        """Return readings by code, in the order of `codes`; of a poll also those of `also`.

        A poll uses the replies that the keeper has read for it (`polled`), and reads the rest.
        """
        if polled is not None:
            self._polled = polled
            try:
                found = await self.read(codes, priority=priority)
            finally:
                self._polled = None
            if polled.block is not None and (block := self._block_at(polled.block)):
                self.using = block.name
            return found
        wanted = list(dict.fromkeys(codes))
        await self._read_sources(wanted, priority)
        found = await self._take(frozenset(wanted), priority)
        self._note_state(wanted)
        decoding = Decoding(self.session)
        return {code: decoding.decode(found[code]) for code in dict.fromkeys((*wanted, *found))}

    def known(self, codes: Iterable[str]) -> dict[str, Reading]:
        """Return the last values that this program has read, however old; nothing is read."""
        image = self.session.image
        held = {code: item for code in codes if (item := image.get(code)) is not None}
        now, before = Decoding(self.session), Decoding(self.session, image.raws)
        trusted, found = image.trusted.keys(), {}
        for code, item in held.items():
            # a value from before the drive may have been reset has a scale from before that, too
            is_before = trusted.isdisjoint({code, *sources_of(item.parameter)})
            found[code] = (before if is_before else now).decode(item)
        return found

    def _note_state(self, codes: Iterable[str]) -> None:
        """Report the read state to the session, which notes when the motor was at standstill."""
        image, read = self.session.image, frozenset(codes)
        for status in {chart.status_codes for chart in self.profile.data.charts}:
            # an older word beside a new one shows a state that never was
            held = [image.get(code) for code in status] if read.issuperset(status) else [None]
            times = [reading.time for reading in held if reading is not None]
            if len(times) == len(held):
                motion = read_chart(self.profile, image.raws).motion
                self.session.note_state(motion, min(times))

    def seconds(self, codes: Iterable[str]) -> float:
        """Return the planned time on the wire of reading these, in seconds, without retries."""
        sure, unsure = self._by_trust(frozenset(codes).difference(self.session.image.refused))
        return self._plans.plan(sure, self.in_force).seconds + self._plans.plan(unsure).seconds

    def groups(self, codes: Iterable[str]) -> list[tuple[str, ...]]:
        """Return the codes, grouped by the request that reads them."""
        wanted = frozenset(codes).difference(self.session.image.refused)
        trusts = self._by_trust(wanted)
        requests = [request for trust in trusts for request in self._plans.plan(trust).requests]
        return [tuple(place.code for place in request.places) for request in requests]

    def planned(self, codes: Iterable[str]) -> tuple[PlannedRead, ...]:
        """The requests by which a poll reads these codes."""
        sure, unsure = self._by_trust(frozenset(codes).difference(self.session.image.refused))
        return planned_reads(self._plans.plan(sure, self.in_force), self._plans.plan(unsure))

    def forget(self) -> None:
        """Discard scales, refusals and slots: another drive may answer now."""
        self.session.image.distrust()
        self.session.byte_order.forget()
        self._plans.clear()
        self._beside.clear()
        self._met.clear()
        self._slots.forget()

    def distrust(self) -> None:
        """Stop using the slots of indirect blocks: the drive may have been reset."""
        self._slots.distrust()

    @property
    def in_force(self) -> dict[str, int]:
        """Return the raw value of each slot of a block or scanner that is certainly in force."""
        return self._slots.in_force() if self.session.reads_blocks else {}

    async def learn_slots(self) -> None:
        """Read the slots of the drive's block or scanner, so that polls can use it.

        Call it regularly, because other programs may change them. Raises the line's errors.
        """
        await self._slots.learn(self._poll)

    async def compare_slots(self) -> None:
        """Identify more places of an indirect block, with a few reads. Raises the line's errors."""
        # the readings before and after the block must be reads of this comparison
        shared, self.max_age = self.max_age, 0.0
        try:
            await self._slots.compare(self._poll)
        finally:
            self.max_age = shared

    def compare_soon(self) -> None:
        """Compare the block soon: the drive's state changed, so equal values may differ now."""
        self._slots.compare_soon()

    async def _poll(self, codes: Iterable[str]) -> Mapping[str, Reading]:
        wanted = tuple(codes)
        found = await self.read(wanted, priority=Priority.POLL)
        return {code: found[code] for code in wanted}

    async def _read_sources(self, codes: list[str], priority: Priority) -> None:
        sources = {source for code in codes for source in sources_of(self.profile[code])}
        now = self.session.clock.monotonic()
        oldest = now - SOURCE_AGE if priority >= Priority.POLL else math.inf
        due = frozenset(code for code in sources - set(codes) if not self._is_known(code, oldest))
        if due:
            await self._take(due, priority)

    def _is_known(self, code: str, oldest: float) -> bool:
        """Return True if a word that scales others was read or refused since `oldest`."""
        image = self.session.image
        held = image.get(code) if code in image.trusted else image.refused.get(code)
        return held is not None and held.time >= oldest

    async def _take(self, codes: frozenset[str], priority: Priority) -> dict[str, Reading]:
        """Read into the image; the readings are not decoded yet."""
        found = self._still_refused(codes) if priority >= Priority.POLL else {}
        image = self.session.image
        sure, unsure = self._by_trust(codes.difference(image.refused, found))
        slots = self.in_force if priority >= Priority.POLL else {}
        found.update(await self._follow(self._plans.plan(sure, slots), priority))
        for request in self._plans.plan(unsure).requests:
            found.update(await self._exchange_unsure(request, priority))
        for code in codes.difference(found):
            found[code] = await self._alone(self.profile[code], priority)
        self.session.take(found)
        return found

    async def _follow(self, plan: ReadPlan, priority: Priority) -> dict[str, Reading]:
        """Carry out a plan; omit a block's values if its slots changed in the meantime."""
        found: dict[str, Reading] = {}
        if priority >= Priority.POLL:
            used = (self._block_of(request) for request in plan.requests)
            self.using = next((block.name for block in used if block), "")
        for request in plan.requests:
            # words of a block from before its slots were read may belong to other slots
            since = self._slots.learned if self._block_of(request) else -math.inf
            found.update(await self._exchange(request, priority, since))
            self._slots.heard()
        for check in plan.checks:
            # slots read before the block may have changed before the block was read
            since = max((found[c].time for c in check.governs if c in found), default=-math.inf)
            raws = await self._exchange(check.request, priority, since)
            if {code: raw.raw for code, raw in raws.items()} != check.slots:
                self._slots.forget()
                for code in check.governs:
                    found.pop(code, None)
        return found

    def _by_trust(self, codes: frozenset[str]) -> tuple[frozenset[str], frozenset[str]]:
        """Separate documented words from the others, if the family ignores missing words."""
        if not meets_silence(self.profile):
            return codes, frozenset()
        sure = frozenset(c for c in codes if c in self._met or is_verified(self.profile[c]))
        return sure, codes - sure

    async def _exchange_unsure(
        self, request: ReadRequest, priority: Priority
    ) -> dict[str, Reading]:
        """Read words that the drive may lack: no answer does not mean that the drive is lost."""
        try:
            found = await self._exchange(request, priority)
            self._met.update(found)
            return found
        except NoAnswer as silence:
            await look_for_drive(self.session, silence)
            text = "no answer: perhaps this drive has no such word"
            now = self.session.clock.monotonic()
            parameters = (self.profile[place.code] for place in request.places)
            return {p.code: Reading.bad(p, now, text, silent=True) for p in parameters}

    def _still_refused(self, codes: frozenset[str]) -> dict[str, Reading]:
        """Return the refusals younger than ASK_AGAIN seconds, which a poll does not repeat."""
        oldest = self.session.clock.monotonic() - ASK_AGAIN
        refused = self.session.image.refused
        return {c: r for c, r in refused.items() if c in codes and (r.silent or r.time > oldest)}

    async def _exchange(
        self, request: ReadRequest, priority: Priority, since: float = -math.inf
    ) -> dict[str, Reading]:
        """Read the raw values of one planned request; a shared reply must be newer than `since`.

        If the drive refuses a longer read, or returns the word for "no value", each affected
        parameter is read separately: only then is the answer certain.
        """
        block = self._block_of(request)
        several = len(request.places) > 1 or block is not None
        try:
            reply = self._polled_reply(request, priority, since) or await self.line.read(
                self.device,
                request.address,
                request.count,
                priority=priority,
                function=request.function,
                max_age=self._longest(request, priority, since),
            )
        except DeviceException as refusal:
            if several:
                return {}
            parameters = (self.profile[place.code] for place in request.places)
            return {p.code: self._refusal(p, refusal) for p in parameters}
        unknown = self.profile.data.reading.unknown_word
        found: dict[str, Reading] = {}
        places = request.places
        if self.also and priority >= Priority.POLL and block is None:
            places += self._newer_beside(request, reply.time)
        for place in places:
            parameter = self.profile[place.code]
            words = reply.words[place.offset : place.offset + word_count(parameter)]
            alone = request.count == word_count(parameter) and block is None
            if alone or parameter.is_bits or unknown not in words:
                found[place.code] = self._reading(parameter, words, reply.time, priority)
        return found

    def _newer_beside(self, request: ReadRequest, reported: float) -> tuple[Place, ...]:
        """Return the places of `also` in a reply that is newer than what is known of them."""
        if request not in self._beside:
            span = range(request.address, request.address + request.count)
            sure, _ = self._by_trust(self.also.difference(place.code for place in request.places))
            own = (self.profile[code] for code in sorted(sure))
            self._beside[request] = tuple(
                Place(parameter.code, parameter.address - request.address)
                for parameter in own
                if parameter.function == request.function
                and parameter.address in span
                and parameter.address + word_count(parameter) - 1 in span
            )
        image, time = self.session.image, self.session.clock.line_time(reported)
        return tuple(
            place
            for place in self._beside[request]
            if place.code not in image.refused and image.changed(place.code) < time
        )

    def _longest(self, request: ReadRequest, priority: Priority, since: float) -> float:
        """Return the greatest age in seconds of a shared reply that may replace this read."""
        if priority < Priority.POLL or not self.max_age:
            return 0.0
        known = self._known_since(request, since)
        return max(0.0, min(self.max_age, self.session.clock.monotonic() - known))

    def _polled_reply(self, request: ReadRequest, priority: Priority, since: float) -> Reply | None:
        """Return the keeper's reply for this poll; None if it has none. Raises line errors."""
        if self._polled is None or priority < Priority.POLL:
            return None
        return self._polled.take(planned_read(request), self._known_since(request, since))

    def _known_since(self, request: ReadRequest, since: float) -> float:
        """Return when the words of a request were last read or written, or `since` if later."""
        image = self.session.image
        return max((since, *(image.changed(place.code) for place in request.places)))

    def _block_of(self, request: ReadRequest) -> Block | None:
        """Return the block or scanner that a request reads; None if it reads parameters."""
        first = request.places[0]
        if self.profile[first.code].address == request.address + first.offset:
            return None
        return self._block_at(request.address)

    def _block_at(self, address: int) -> Block | None:
        blocks = self.profile.data.blocks
        return next((b for b in blocks if 0 <= address - b.address < b.max_words), None)

    async def _alone(self, parameter: Parameter, priority: Priority) -> Reading:
        count = word_count(parameter)
        read = PlannedRead(parameter.address, count, parameter.function)
        try:
            more = self._polled.take_more(read) if self._polled is not None else None
            reply = more or await self.line.read(
                self.device,
                parameter.address,
                count,
                priority=priority,
                function=parameter.function,
            )
        except DeviceException as refusal:
            return self._refusal(parameter, refusal)
        return self._reading(parameter, reply.words, reply.time, priority)

    def _reading(
        self, parameter: Parameter, words: Sequence[int], reported: float, priority: Priority
    ) -> Reading:
        origin = Origin.POLL if priority >= Priority.POLL else Origin.READ
        time = self.session.clock.line_time(reported)
        return Reading.undecoded(parameter, from_words(parameter, words), time, origin)

    def _refusal(self, parameter: Parameter, refusal: DeviceException) -> Reading:
        absent = refusal.code == self.profile.data.reading.unknown_exception
        now = self.session.clock.monotonic()
        if isinstance(refusal, NotRecorded):
            now = NEVER_READ
        return Reading.bad(parameter, now, str(refusal), absent=absent)
