"""Write of one parameter: sent once, read back, compared, and recorded in the journal."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import dataclass, replace
from functools import partial

from tui.bus.api import Priority
from tui.bus.errors import DeviceException, LineError, RequestRefused, Superseded
from tui.drive.errors import DriveError
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.sentences import sentence
from tui.drive.settings.memory_orders import eeprom_use
from tui.drive.settings.writable import is_setting
from tui.drive.shown import depends_on, shown_text
from tui.drive.values import from_words, is_field, to_words, word_count

from ..arming import NotArmed
from ..drive import DriveSession, why_unproved
from ..journal import Entry, Journal, now_text
from ..read.reader import Reader
from ..reading import Reading
from ..work import Permit

log = logging.getLogger(__name__)


class NotTaken(DriveError):
    """The drive acknowledged a write, but holds another value."""


@dataclass(frozen=True, slots=True)
class Writer:
    """Writes parameters of one drive under the permit of a task; None for a stop."""

    session: DriveSession
    journal: Journal
    permit: Permit | None

    async def write_parameter(
        self,
        parameter: Parameter,
        raw: int,
        *,
        why: str,
        check: int = 0xFFFFFFFF,
        replaceable: bool = False,
        read_back: bool = True,
        priority: Priority = Priority.OPERATOR_WRITE,
        within: float | None = None,
    ) -> bool:
        """Write a raw value, read it back, and compare the bits of `check`; True if it was read.

        While a `replaceable` write waits, a newer one of the same parameter replaces it. The value
        is unknown from the write until it is read back. `within` is the longest wait for the reply
        in seconds.

        Raises Stopped and NotArmed, the line's errors, and NotTaken if the drive holds another
        value.
        """
        session, code = self.session, parameter.code
        if self.permit is not None:
            self.permit.check()
            if unproved := why_unproved(session, parameter, raw):
                raise NotArmed(unproved)
            await self._read_scale(parameter)
        held = await self._held_word(parameter) if is_field(parameter) else None
        before = session.image.get(code)
        answer, back, lost, sent = "ok", None, False, True
        refused = False
        self._doubt(parameter)
        try:
            await session.line.write(
                session.device,
                parameter.place,
                to_words(parameter, raw, held),
                priority=priority,
                replaceable=replaceable,
                forbidden=self.permit.refusal if self.permit is not None else None,
                within=within,
            )
            answer = NOT_IN_EFFECT
            await self._enter(parameter)
            answer = "ok"
            back = await self._read_back(parameter) if read_back else None
            if back is not None and (back ^ raw) & check & 0xFFFFFFFF:
                answer = "holds another value"
                raise NotTaken(
                    f"{code} was written as {raw_text(self.session, parameter, raw)}, but the drive"
                    f" holds {raw_text(self.session, parameter, back)}."
                )
        except (RequestRefused, Superseded) as error:
            answer, sent = str(error), False
            # never sent: the value before the write is still known
            self._believe(parameter, before)
            raise
        except DeviceException as error:
            answer, refused = str(error), True
            raise
        except LineError as error:
            answer, lost = str(error), True
            raise
        except asyncio.CancelledError:
            answer, lost = CUT_SHORT, True
            raise
        finally:
            old = before.raw if before is not None else None
            try:
                if sent and not refused and parameter.storage == "ram-until-saved":
                    self._note_unsaved(parameter, old, back)
                entry = parameter_entry(
                    session, parameter, old=old, new=raw, answer=answer, why=why, read_back=back,
                    refused=refused,
                )  # fmt: skip
                self.journal.add(entry, sent=sent)
                if lost:
                    self.complete_later(entry, parameter, check if read_back else 0)
            except Exception:
                if self.permit is not None:
                    raise
                # an error of the journal must not make a stop that was sent fail
                log.exception("a stop of device %s is not in the journal", session.device)
        return back is not None

    async def _enter(self, parameter: Parameter) -> None:
        """Have the drive use a written setting, if its family needs a further word for that.

        Raises NotTaken if that word is refused, lost or not sent.
        """
        profile = self.session.profile
        enter = profile.data.memory.enter
        if enter is None or self._is_copy(parameter) or not is_setting(profile, parameter):
            return
        if enter.when is not None:
            await Reader(self.session).read([enter.when.parameter])
            if enter.when.holds(self.session.image.raws) is False:
                return
        try:
            await self.write_parameter(
                profile[enter.parameter], enter.raw, why=f"enter {parameter.code}", read_back=False
            )
        except (LineError, DriveError) as error:
            raise NotTaken(
                f"{parameter.code} was written, but the drive does not use it yet:"
                f" {sentence(str(error))} The next setting that is written enters it, too."
            ) from error

    def _is_copy(self, parameter: Parameter) -> bool:
        """Return True for the copy of a setting in EEPROM, whose value the image does not hold."""
        return parameter.address != self.session.profile[parameter.code].address

    def _doubt(self, parameter: Parameter) -> None:
        if not self._is_copy(parameter):
            self.session.image.doubt(parameter.code)

    def _believe(self, parameter: Parameter, before: Reading | None) -> None:
        if not self._is_copy(parameter):
            self.session.image.believe(parameter.code, before)

    def _note_unsaved(self, parameter: Parameter, before: int | None, now: int | None) -> None:
        unsaved = self.session.unsaved_settings
        if parameter.resets_others:
            unsaved.forget_values()
            before = None
        unsaved.note_write(parameter.code, before, now)

    def complete_later(self, entry: Entry, parameter: Parameter, check: int = 0xFFFFFFFF) -> None:
        """Complete the journal entry of a write without a reply at the next read of the parameter.

        It counts as taken if the bits of `check` are as written; with 0 nothing is compared. A read
        does not show the copy of a setting in EEPROM.
        """
        if self._is_copy(parameter):
            return
        self.session.image.tell_once(
            parameter.code, partial(self._complete, entry, parameter, check)
        )

    def _complete(self, entry: Entry, parameter: Parameter, check: int, back: int) -> None:
        taken = not (back ^ entry.new_raw) & check & 0xFFFFFFFF
        text = _HOLDS if not check else _HOLDS_ACCEPTED if taken else _HOLDS_NOT_ACCEPTED
        answer = text.format(value=raw_text(self.session, parameter, back))
        self.journal.add(
            replace(
                entry,
                time=now_text(),
                kind="read-back",
                of=entry.time,
                answer=answer,
                read_back=back,
            )
        )

    async def _read_scale(self, parameter: Parameter) -> None:
        """Read the words that the parameter's scale and unit depend on, for the journal."""
        image = self.session.image
        known = {*image.trusted, *image.lacking}
        if unknown := [code for code in depends_on(parameter) if code not in known]:
            await Reader(self.session).read(unknown)

    async def _held_word(self, parameter: Parameter) -> int:
        """Read the word that contains a field, because its other bits must be kept."""
        reply = await self.session.line.read(
            self.session.device, parameter.address, 1, priority=Priority.OPERATOR_WRITE
        )
        return reply.words[0]

    async def _read_back(self, parameter: Parameter) -> int | None:
        """Read the value and store it in the image; None if the drive does not report it."""
        if parameter.access == "w":
            return None
        count = word_count(parameter)
        try:
            reply = await self.session.line.read(
                self.session.device,
                parameter.address,
                count,
                priority=Priority.OPERATOR_WRITE,
                function=parameter.function,
            )
        except DeviceException:
            return None
        back = from_words(parameter, reply.words)
        if not self._is_copy(parameter):
            when = self.session.clock.line_time(reply.time)
            self.session.image.confirm(parameter.code, back, when)
        return back


_HOLDS = "It holds {value}, read back later."
_HOLDS_ACCEPTED = "Accepted: it holds {value}, read back later."
_HOLDS_NOT_ACCEPTED = "Not accepted: it holds {value}, read back later."
NOT_IN_EFFECT = "not in effect"
"""Journal text of a setting whose entering word was refused or not sent."""
CUT_SHORT = "canceled by a stop, may have taken effect"
"""Journal text of a write that was canceled before its reply."""


def raw_text(session: DriveSession, parameter: Parameter, raw: int | None) -> str:
    """Return a raw value with its unit or name; empty for None."""
    image = session.image
    return shown_text(session.profile, parameter, raw, image.raws, image.lacking)


def parameter_entry(
    session: DriveSession,
    parameter: Parameter,
    *,
    old: int | None,
    new: int,
    answer: str,
    why: str,
    read_back: int | None = None,
    refused: bool = False,
) -> Entry:
    """Make the journal entry of a write, with raw values before, after, and read back.

    `refused` is True if the drive refused it, so that its EEPROM holds what it held.
    """
    use = "" if refused else eeprom_use(session.profile, parameter, new)
    return Entry(
        time=now_text(),
        line=session.line_text,
        device=session.device,
        profile=session.profile.id,
        code=parameter.code,
        address=parameter.address,
        old_raw=old,
        old=raw_text(session, parameter, old),
        new_raw=new,
        new=raw_text(session, parameter, new),
        answer=answer,
        read_back=read_back,
        why=why,
        drive=session.known_identity.text if use else "",
        eeprom=use,
    )


def device_refusal(
    profile: Profile, parameter: Parameter, error: DeviceException, headline: str
) -> str:
    """Explain an exception reply to a write: its meaning in this family, and the next step."""
    known = next((e for e in profile.data.exceptions if e.code == error.code), None)
    if known is None:
        return (
            f"The drive refused {parameter.code} with exception {error.code}, which no document of"
            f" this family explains. The drive is {headline}."
        )
    parts = (
        f"The drive refused {parameter.code} with exception {known.code}, {known.name}.",
        sentence(known.meaning) if known.meaning else "",
        f"The drive is {headline}.",
        sentence(known.remedy) if known.remedy else "",
    )
    return " ".join(filter(None, parts))
