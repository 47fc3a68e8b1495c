"""First word of a stop, sent to a drive that is not identified.

Reads, which move nothing, exclude families: the status word of each kind of family, and the word
that selects its stop. Then one word is sent that stops all remaining families
(`tui.drive.first_stop`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from tui.bus.api import ModbusLine, Priority
from tui.bus.errors import DeviceException, ExchangeError, LineError, NoAnswer
from tui.bus.limits import Limits
from tui.bus.link import label
from tui.drive.first_stop import FirstWord, StopPlace, first_word, followers, stop_places
from tui.drive.orders import stop_alike
from tui.drive.profile import library
from tui.drive.profile.schema import OrderId
from tui.drive.profile.stop_profile import StopProfile, stop_profile_of
from tui.drive.sentences import any_of
from tui.wire.frames import BIT_READS, at_place, written_text

from ..drive import DriveSession
from ..journal import Entry, Journal, now_text

ONE_WORD = Limits(
    functions=frozenset({1, 2, 3, 5, 6, 17, 43}),
    max_read=1,
    max_write=1,
    max_read_23=0,
    max_write_23=0,
)
"""Requests allowed to an unidentified drive."""
STOP_OF_SEVERAL = replace(
    ONE_WORD, functions=ONE_WORD.functions | {15, 16}, max_write=2, max_write_15=16
)
"""The same for a command word of 32 bits or of several coils."""
FIRST_WHY = "stopped before it was identified"


_SENT = "16#{word:04X} to {code}, the stop of {families}"
_SENT_IN_VAIN = "16#{word:04X} to {code}, the stop of {families} ({answer})"


@dataclass(frozen=True, slots=True)
class SentFirst:
    """A word that was sent, with its result."""

    what: FirstWord
    answer: str
    """`ok`, or another result in a few words."""

    @property
    def taken(self) -> bool:
        """True if the drive has acknowledged it."""
        return self.answer == "ok"

    @property
    def text(self) -> str:
        """The word, its register, the families that it stops, and its result, for a person."""
        names = [family.name for family in self.what.families]
        text = _SENT if self.taken else _SENT_IN_VAIN
        what = self.what
        return text.format(
            word=what.word, code=what.code, families=any_of(names), answer=self.answer
        )


@dataclass(frozen=True, slots=True)
class FirstStop:
    """Result of the first stop words: what was sent, and the families that remain."""

    sent: tuple[SentFirst, ...]
    ruled_out: frozenset[str]
    """Families whose status word the drive reported as missing."""
    followers: tuple[str, ...] = ()
    """Families by whose profile an unidentified drive may be followed to standstill."""
    answered: bool = False
    """True if the drive has sent any reply."""

    def may_be(self, family: str) -> bool:
        """Return True if an unidentified drive may be of this family."""
        if family in self.ruled_out:
            return False
        return family in self.followers or not self.sent

    @property
    def taken(self) -> FirstWord | None:
        """The word that the drive acknowledged; None if it acknowledged none."""
        return next((sent_word.what for sent_word in self.sent if sent_word.taken), None)


@dataclass(frozen=True, slots=True)
class _Look:
    there: bool | None
    """True if the drive has such a status word; None if it did not answer."""
    raws: dict[int, int]


def unlike_families(session: DriveSession) -> tuple[StopProfile, ...]:
    """Return the candidate families of a guessed drive if no one stop word stops them all."""
    ids = session.known_identity.candidates if session.guessed else ()
    profiles = [library.load(id_) for id_ in ids]
    if stop_alike(profiles):
        return ()
    return tuple(stop_profile_of(profile, names_itself=False) for profile in profiles)


async def stop_first(
    line: ModbusLine,
    device: int,
    journal: Journal,
    families: Sequence[StopProfile],
    named: Sequence[str],
    wanted: OrderId,
) -> FirstStop:
    """Send a drive words that stop every family that it may be of, `named` ones first.

    Nothing is written if the drive refuses the status word of a family. If it does not answer at
    all, only the word of the named families is sent. Raises LineClosed, LineLost, RequestRefused.
    """
    line.describe(device, ONE_WORD)
    sent: list[SentFirst] = []
    ruled_out: set[str] = set()
    follow: tuple[str, ...] = ()
    answered = False
    for place in stop_places(families, named):
        known = any(family.id in named for family in place.families)
        look = await _look(line, device, place, again=known)
        answered = answered or look.there is not None
        if look.there is False:
            ruled_out |= {family.id for family in place.families}
            continue
        if look.there is None and not known:
            continue
        what = first_word(place, look.raws, wanted, named)
        if what is None:
            continue
        sent.append(await _send(line, device, journal, what))
        follow = followers(what, look.raws, wanted)
        if sent[-1].taken or look.there:
            break
    answered = answered or any(sent_word.taken for sent_word in sent)
    return FirstStop(tuple(sent), frozenset(ruled_out), follow, answered)


async def _look(line: ModbusLine, device: int, place: StopPlace, *, again: bool) -> _Look:
    """Read the words that show if a drive is of these families, and that select its stop word."""
    raws: dict[int, int] = {}
    # without a status word to read, only a family that the user named is stopped
    there: bool | None = False if place.status else None
    for address in place.status:
        try:
            raws[address] = await _read(line, device, address, again=again)
        except DeviceException:
            continue
        except ExchangeError:
            return _Look(None, {})
        there = True
    if there:
        for address in place.deciding:
            try:
                raws[address] = await _read(line, device, address, again=True)
            except ExchangeError:
                continue  # the word is then one that stops the drive whatever this holds
    return _Look(there, raws)


async def _read(line: ModbusLine, device: int, place: int, *, again: bool) -> int:
    """Read a word; with `again`, once more if there was no valid reply."""
    try:
        return await _read_once(line, device, place)
    except DeviceException:
        raise
    except ExchangeError:
        if not again:
            raise
        return await _read_once(line, device, place)


async def _read_once(line: ModbusLine, device: int, place: int) -> int:
    function, address = at_place(place)
    reply = await line.read(device, address, 1, priority=Priority.STOP, function=function)
    return reply.words[0]


async def _send(line: ModbusLine, device: int, journal: Journal, what: FirstWord) -> SentFirst:
    """Write the word once, and record it in the journal whatever the result."""
    answer = reported = "interrupted by a signal: it is not known if the drive received it"
    if len(what.values) > 1:
        line.describe(device, STOP_OF_SEVERAL)
    try:
        await line.write(device, what.address, what.values, priority=Priority.STOP)
        answer = reported = "ok"
    except DeviceException as error:
        answer, reported = str(error), "refused"
    except ExchangeError as error:
        answer, reported = (
            str(error),
            "no answer" if isinstance(error, NoAnswer) else "no valid answer",
        )
    except LineError as error:
        answer = reported = str(error)
        raise
    finally:
        if len(what.values) > 1:
            line.describe(device, ONE_WORD)
        journal.add(_entry(line, device, what, answer))
    return SentFirst(what, reported)


def _entry(line: ModbusLine, device: int, what: FirstWord, answer: str) -> Entry:
    function, address = at_place(what.address)
    new = f"16#{what.word:0{4 * len(what.values)}X}"
    if function in BIT_READS:
        new = written_text(what.address, what.values)
    return Entry(
        time=now_text(),
        line=label(line.link),
        device=device,
        profile=",".join(family.id for family in what.families),
        code=what.code,
        address=address,
        old_raw=None,
        old="",
        new_raw=what.word,
        new=new,
        answer=answer,
        read_back=None,
        why=FIRST_WHY,
    )
