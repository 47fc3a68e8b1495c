"""Reading parameters of one drive: plan, exchange, decode; a refused word hurts no other."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from tui.bus.errors import DeviceException
from tui.bus.line import Line, Priority, Reply
from tui.bus.link import TcpLink, character_time, silence
from tui.drive.profile import Profile
from tui.drive.read_plan import ReadPlan, ReadRequest, WireTiming, plan_reads
from tui.drive.schema import Parameter
from tui.drive.values import decode, from_words, word_count

from .limits import limits_of
from .readings import Quality, Reading

ASK_AGAIN = 30.0
"""Seconds after which a poll asks again for a parameter that the drive refused."""


@dataclass(frozen=True, slots=True)
class Raw:
    """A raw value with the time it was on the wire, or why there is none."""

    time: float
    raw: int | None
    error: str = ""
    absent: bool = False
    """True where the drive itself said that it has no such word."""


@dataclass(slots=True)
class Reader:
    """Reads parameters of one drive and keeps what their scales depend on.

    Raises the line's errors for all but a drive's refusal, which makes only the refused
    parameter bad.
    """

    line: Line
    device: int
    profile: Profile
    _scale_sources: dict[str, Raw] = field(default_factory=dict)
    _refused: dict[str, Raw] = field(default_factory=dict)
    _plans: dict[tuple[frozenset[str], frozenset[str]], ReadPlan] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.line.describe(self.device, limits_of(self.profile))

    async def read(
        self, codes: Iterable[str], *, priority: Priority = Priority.OPERATOR_READ
    ) -> dict[str, Reading]:
        """Readings by code, in the order asked for."""
        wanted = list(dict.fromkeys(codes))
        await self._read_scale_sources(wanted, priority)
        raws = await self._raws(frozenset(wanted), priority)
        return {code: self._reading(self.profile[code], raws[code]) for code in wanted}

    def forget(self) -> None:
        """Read scales and refused parameters anew: another drive may answer now."""
        self._scale_sources.clear()
        self._refused.clear()
        self._plans.clear()

    async def _read_scale_sources(self, codes: list[str], priority: Priority) -> None:
        sources = {
            parameter.scale_by.parameter
            for code in codes
            if (parameter := self.profile[code]).scale_by is not None
        }
        missing = frozenset(sources - set(self._scale_sources))
        if missing:
            self._scale_sources.update(await self._raws(missing, priority))

    async def _raws(self, codes: frozenset[str], priority: Priority) -> dict[str, Raw]:
        found = self._still_refused(codes) if priority >= Priority.POLL else {}
        for request in self._plan(codes - self._refused.keys()).requests:
            found.update(await self._exchange(request, priority))
        for code in codes - found.keys():
            found[code] = await self._alone(self.profile[code], priority)
        self._note_scale_sources(found)
        return found

    def _still_refused(self, codes: frozenset[str]) -> dict[str, Raw]:
        """Refusals young enough that a poll need not ask again."""
        oldest = time.monotonic() - ASK_AGAIN
        return {c: r for c, r in self._refused.items() if c in codes and r.time > oldest}

    def _note_scale_sources(self, found: Mapping[str, Raw]) -> None:
        """A scale source that is read for its own sake is fresher than the one kept."""
        for code in self._scale_sources.keys() & found.keys():
            self._scale_sources[code] = found[code]

    def _plan(self, codes: frozenset[str]) -> ReadPlan:
        key = (codes, frozenset(self._refused))
        if key not in self._plans:
            self._plans[key] = plan_reads(
                self.profile, sorted(codes), self._timing(), unreadable=key[1]
            )
        return self._plans[key]

    def _timing(self) -> WireTiming:
        link = self.line.link
        if isinstance(link, TcpLink):
            return WireTiming(character=0.0, silence=0.0, turnaround=0.005)
        return WireTiming(character_time(link), silence(link))

    async def _exchange(self, request: ReadRequest, priority: Priority) -> dict[str, Raw]:
        """The raw values of one planned request.

        Where the drive refuses a longer read, or answers a word with the one that stands for
        "no value", the parameter is asked for alone: only then is the answer certain.
        """
        several = len(request.places) > 1
        try:
            reply = await self.line.read(
                self.device, request.address, request.count, priority=priority
            )
        except DeviceException as refusal:
            if several:
                return {}
            self._refused.update({p.code: self._refusal(refusal) for p in request.places})
            return {p.code: self._refused[p.code] for p in request.places}
        unknown = self.profile.data.reading.unknown_word
        found: dict[str, Raw] = {}
        for place in request.places:
            parameter = self.profile[place.code]
            words = reply.words[place.offset : place.offset + word_count(parameter)]
            if not (request.count > word_count(parameter) and unknown in words):
                found[place.code] = Raw(reply.time, from_words(parameter, words))
        return found

    async def _alone(self, parameter: Parameter, priority: Priority) -> Raw:
        count = word_count(parameter)
        try:
            reply: Reply = await self.line.read(
                self.device, parameter.address, count, priority=priority
            )
        except DeviceException as refusal:
            self._refused[parameter.code] = self._refusal(refusal)
            return self._refused[parameter.code]
        self._refused.pop(parameter.code, None)
        return Raw(reply.time, from_words(parameter, reply.words))

    def _refusal(self, refusal: DeviceException) -> Raw:
        absent = refusal.code == self.profile.data.reading.unknown_exception
        return Raw(time.monotonic(), None, str(refusal), absent)

    def _reading(self, parameter: Parameter, raw: Raw) -> Reading:
        if raw.raw is None:
            return Reading.bad(parameter, raw.time, raw.error)
        sources = {
            code: source.raw
            for code, source in self._scale_sources.items()
            if source.raw is not None
        }
        scale = self.profile.scale(
            parameter, sources, absent={c for c, s in self._scale_sources.items() if s.absent}
        )
        value = decode(parameter, raw.raw, self.profile.names(parameter), scale)
        return Reading(parameter, raw.raw, value, Quality.GOOD, raw.time)
