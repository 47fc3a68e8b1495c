"""Editor of the blocks of one drive: values, comparisons, and writes.

A worker of the line's loop reads the values while a screen shows them. Proposed assignments are in
`proposals`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tui.bus.api import LineWorker, Priority
from tui.bus.errors import DeviceException, LineError
from tui.drive.blocks.assignment import Assignment, MappingError
from tui.drive.blocks.user_words import COUNT, UserWord, UserWords, format_named, is_no_value
from tui.drive.errors import DriveError
from tui.drive.orders import OrderRefused
from tui.drive.profile.schema import Block
from tui.drive.sentences import sentence
from tui.drive.settings.writable import AT_REST

from ..drive import DriveSession
from ..journal import Journal
from ..monitor.monitor import Monitor
from ..monitor.snapshot import Snapshot
from ..paths import state_folder
from ..read.proof import SlotMatch
from ..stored import store_json, stored_json
from ..work import Outcome, OutcomeKind, Permit, Task
from .exchange import exchange
from .mapping import BlockView, Force, Mapper
from .outputs import ConfirmedWrite, example, intended, refuse_pending, values_text
from .proposals import Proposals
from .write import at_rest_only, write_assignment


async def read_words(session: DriveSession, words: UserWords) -> list[int | None]:
    """Read the raw words; None for one that is unassigned, missing or protected.

    Raises the line's errors except a refusal. If the family does not answer unknown addresses, only
    known ones are read.
    """
    found: list[int | None] = []
    function = session.profile.function(3)
    silent = function is not None and function.past_limit == "silence"
    for word in words:
        known = session.profile.at(word.address) is not None
        if not word.address or (silent and not known):
            found.append(None)
            continue
        try:
            reply = await session.line.read(
                session.device, word.address, 1, priority=Priority.OPERATOR_READ
            )
        except DeviceException:
            found.append(None)
        else:
            none = not known and is_no_value(session.profile, reply.words)
            found.append(None if none else reply.words[0])
    return found


def load_words(session: DriveSession) -> UserWords:
    """Return the stored words of this drive on this line; four unassigned words if none."""
    kept = _kept().get(_key(session), [])
    words: list[UserWord] = []
    for item in kept[:COUNT] if isinstance(kept, list) else []:
        try:
            words.append(UserWord(int(item["address"]) & 0xFFFF, format_named(item["format"])))
        except (KeyError, TypeError, ValueError, AttributeError, MappingError):
            words.append(UserWord())
    return (*words, *(UserWord(),) * (COUNT - len(words)))


def save_words(session: DriveSession, words: UserWords) -> str:
    """Store the words of this drive; return the error, or an empty string."""
    kept = _kept()
    kept[_key(session)] = [{"address": w.address, "format": w.format} for w in words]
    try:
        store_json(_file(), kept)
    except OSError as error:
        return f"The user words cannot be stored: {error.strerror or error}."
    return ""


def _kept() -> dict[str, object]:
    reported = stored_json(_file())
    return reported if isinstance(reported, dict) else {}


def _key(session: DriveSession) -> str:
    return f"{session.line_text} {session.device} {session.profile.id}"


def _file() -> Path:
    return state_folder() / "user-words.json"


LOOK_EVERY = 1.0
"""Seconds between two reads of the blocks."""
LOOK_AFTER_ERROR = 1.0


@dataclass(slots=True)
class BlockEditor:
    """Known and proposed assignments of a drive's blocks, and the work on them."""

    session: DriveSession
    monitor: Monitor
    journal: Journal
    views: dict[str, BlockView] = field(default_factory=dict)
    """The last comparison of each block, by its id; replaced as a whole."""
    proposals: Proposals = field(init=False)
    words: UserWords = field(default_factory=tuple)
    word_raws: list[int | None] = field(default_factory=list)
    trouble: str = ""
    """Error of the last read; empty if it succeeded."""
    mapper: Mapper = field(init=False)
    _reader: LineWorker | None = None
    _verify: bool = False

    def __post_init__(self) -> None:
        self.proposals = Proposals(self.session, lambda: self.busy)
        self.mapper = Mapper(self.session, lambda: self.monitor.reader.in_force)
        self.words = load_words(self.session)
        self.word_raws = [None] * len(self.words)

    @property
    def busy(self) -> bool:
        """True if something is being written."""
        return self.session.work.busy_for(self)

    @property
    def message(self) -> Outcome | None:
        """Result of the last work on the drive."""
        return self.session.work.outcome

    # Reading

    def start(self) -> None:
        """Start reading and comparing."""
        self.stop()
        self._reader = self.session.line.spawn(self._watch, f"blocks {self.session.device}")

    def stop(self) -> None:
        """Stop reading; a write in progress continues."""
        if self._reader is not None:
            self._reader.cancel()
            self._reader = None

    def verify(self) -> None:
        """Compare every slot several times at the next check, and report the result."""
        self._verify = True
        self._say("Comparing each slot with direct reads", OutcomeKind.WORKING)

    async def _watch(self) -> None:
        while True:
            try:
                await self._look()
            except (LineError, DriveError) as error:
                self.trouble = str(error)
                await self.session.clock.sleep(LOOK_AFTER_ERROR)
            else:
                self.trouble = ""
                await self.session.clock.sleep(0.0 if self._verify else LOOK_EVERY)

    async def _look(self) -> None:
        verify, self._verify = self._verify, False
        for block in self.proposals.blocks:
            look = self.mapper.verify if verify else self.mapper.look
            view = await look(block)
            self.views = {**self.views, block.id: view}
        self.word_raws = await read_words(self.session, self.words)
        if verify:
            text, good = _verdict(list(self.views.values()))
            self._say(text, OutcomeKind.DONE if good else OutcomeKind.REFUSED)

    def _wait_for_a_reset(self) -> None:
        """Note when the drive was silent or restarts: values that wait for a reset may now
        apply."""

        def seen(snapshot: Snapshot) -> None:
            if snapshot.error or snapshot.state.kind == "starting":
                self.mapper.note_reset()
                leave()

        leave = self.monitor.listen(seen)

    # User words

    def assign_words(self, words: UserWords) -> None:
        """Monitor other words from now on, and store them for this drive."""
        self.words, self.word_raws = words, [None] * len(words)
        if wrong := save_words(self.session, words):
            self._say(wrong, OutcomeKind.REFUSED)

    # Writing

    def not_now(self, block: Block) -> str:
        """Return why the slots of a block cannot be written in the state that Monitor shows."""
        latest = self.monitor.latest
        if latest is None or latest.error or latest.state.motion in AT_REST:
            return ""
        return at_rest_only(block, latest.state.headline or latest.state.kind)

    def write_proposals(self, stamp: int | None = None) -> None:
        """Write the proposals; returns immediately."""
        proposals = self.proposals
        plans = [proposals.plans[b.id] for b in proposals.blocks if b.id in proposals.plans]

        async def work(permit: Permit) -> str:
            texts = []
            for plan in plans:
                if plan.block.effective == "after-reset":
                    # even if the write fails: slots that were already written wait for the reset
                    self.mapper.written |= {c.slot: c.new for c in proposals.changes(plan.block)}
                    self._wait_for_a_reset()
                done = await write_assignment(
                    self.session,
                    self.journal,
                    plan,
                    permit=permit,
                    expected=proposals.seen.get(plan.block.id),
                )
                self.views = {
                    **self.views,
                    plan.block.id: await self.mapper.look(plan.block),
                }
                proposals.plans.pop(plan.block.id, None)
                texts.append(done.text)
            return " ".join(dict.fromkeys(texts))

        self._run(work, "Writing, each slot read back", stamp)

    def example(self) -> str:
        """Return an example of a text that writes through the outputs. Raises MappingError."""
        image = self.session.image
        return example(self.session.profile, self._outputs(), image.raws, image.lacking)

    def intended(self, text: str) -> ConfirmedWrite:
        """Parse `LFRD=1500 ACC=5.0` for the present outputs, with the consequences.

        Raises ValueRefused, UnknownParameter and MappingError with what is wrong.
        """
        session, outputs = self.session, self._outputs()
        refuse_pending(outputs, self.mapper.written)
        read = next((b for b in self.proposals.blocks if b.direction == "read"), None)
        inputs = self.proposals.today(read) if read else None
        known = session.image.raws, session.image.lacking
        return intended(session.profile, session.device, outputs, inputs, *known, text)

    def exchange(self, agreed: ConfirmedWrite, stamp: int | None = None) -> None:
        """Write confirmed values through the outputs; returns immediately."""
        session = self.session

        async def work(permit: Permit) -> str:
            done = await exchange(
                session,
                self.journal,
                agreed.outputs,
                agreed.wanted,
                agreed.inputs,
                permit=permit,
                in_force=True,
            )
            known = session.image.raws, session.image.lacking
            sent = values_text(session.profile, agreed.wanted, *known)
            back = values_text(session.profile, done.inputs, *known)
            return f"Wrote {sent}. The reply has {back}." if back else f"Wrote {sent}."

        self._run(work, "Writing through the outputs", stamp)

    def _outputs(self) -> Assignment:
        block = next((b for b in self.proposals.blocks if b.direction == "write"), None)
        plan = self.proposals.today(block) if block else None
        if plan is None or not plan.length:
            raise MappingError("No output slot is mapped. Map one first.")
        return plan

    def _run(
        self, work: Callable[[Permit], Coroutine[Any, Any, str]], doing: str, stamp: int | None
    ) -> None:
        """Queue work on the drive; refused while other work is in progress, canceled by a stop."""
        queue = self.session.work
        if queue.busy:
            self._say("Another command is in progress. Wait until it ends.", OutcomeKind.REFUSED)
            return
        cut_short = False

        async def carry_out(permit: Permit) -> str:
            nonlocal cut_short
            try:
                return await work(permit)
            except asyncio.CancelledError:
                cut_short = True
                raise

        def given_up() -> str | None:
            self._look_again()
            return "Values that were already written stay." if cut_short else None

        try:
            queue.put(Task(carry_out, owner=self, working=doing, given_up=given_up), stamp)
        except OrderRefused as refused:
            self._say(str(refused), OutcomeKind.REFUSED)

    def _look_again(self) -> None:
        """Compare again: unfinished work leaves an unknown state."""
        with suppress(LineError):
            self.session.line.spawn(self._see_again, f"blocks {self.session.device} again")

    async def _see_again(self) -> None:
        """Read the slots again after a refusal, so that the person sees them and may write
        again."""
        with suppress(LineError, DriveError):
            for id, plan in list(self.proposals.plans.items()):
                view = await self.mapper.look(plan.block)
                self.views = {**self.views, id: view}
                self.proposals.seen[id] = view.raws

    def refuse(self, text: str) -> None:
        """Report why something was not done."""
        self._say(text, OutcomeKind.REFUSED)

    def _say(self, text: str, kind: OutcomeKind) -> None:
        self.session.work.report(kind, text)


_WRONG = {
    (False, False): "{slot.code} {slot.verdict}",
    (False, True): "{slot.code} {slot.verdict} until the next reset",
    (True, False): "{slot.code} {slot.verdict}, returns {slot.returned_code}",
    (True, True): "{slot.code} {slot.verdict}, returns {slot.returned_code} until the next reset",
}
"""By whether the slot brings something, and whether it waits for a reset."""


def _verdict(views: list[BlockView]) -> tuple[str, bool]:
    """Return the result of comparing all blocks, and whether all is well."""
    wrong: list[str] = []
    counted = 0
    for view in views:
        if view.block.direction != "read":
            continue
        if view.trouble:
            wrong.append(view.trouble)
        for slot in view.slots:
            counted += slot.verdict in (SlotMatch.SAME, SlotMatch.MOVING)
            if slot.verdict in (SlotMatch.DIFFERS, SlotMatch.CHANGED, SlotMatch.NONE):
                text = _WRONG[bool(slot.returned_code), slot.force is Force.PENDING]
                wrong.append(text.format(slot=slot))
    text = f"{counted} slots match direct reads."
    if wrong:
        return " ".join([*map(sentence, wrong), text]), False
    return text, True
