"""Writing one parameter: sent once, read back, compared, and put into the journal."""

from __future__ import annotations

from dataclasses import dataclass

from tui.bus.errors import DeviceException, LineError
from tui.bus.line import Priority
from tui.drive.errors import DriveError
from tui.drive.schema import Parameter
from tui.drive.values import decode, from_words, to_words

from .drive_session import DriveSession
from .journal import Entry, Journal, now_text


class NotTaken(DriveError):
    """A write that the drive answered well and did not take: it holds something else."""


@dataclass(frozen=True, slots=True)
class Writer:
    """Writes the parameters of one drive."""

    session: DriveSession
    journal: Journal

    async def write(
        self,
        parameter: Parameter,
        raw: int,
        *,
        why: str,
        check: int = 0xFFFFFFFF,
        replaceable: bool = False,
        read_back: bool = True,
        priority: Priority = Priority.OPERATOR_WRITE,
    ) -> None:
        """Write a raw value and see that the drive holds it, in the bits of `check`.

        A `replaceable` one gives way to a newer value of the same parameter while it waits.

        Raises the line's errors, and NotTaken where the drive holds something else.
        """
        session = self.session
        old = session.monitor.known.raws().get(parameter.code)
        answer, back = "ok", None
        try:
            await session.line.write(
                session.device,
                parameter.address,
                to_words(parameter, raw),
                priority=priority,
                replaceable=replaceable,
            )
            back = await self._read_back(parameter) if read_back else None
            if back is not None and (back ^ raw) & check & 0xFFFFFFFF:
                answer = "holds another value"
                raise NotTaken(
                    f"{parameter.code}: written {self._text(parameter, raw)}, the drive holds"
                    f" {self._text(parameter, back)}."
                )
        except LineError as error:
            answer = str(error)
            raise
        finally:
            session.monitor.known.put(parameter.code, raw if back is None else back)
            self.journal.add(self._entry(parameter, old, raw, answer, back, why))

    async def _read_back(self, parameter: Parameter) -> int | None:
        """What the drive holds now; None where it does not tell."""
        if parameter.access == "w":
            return None
        count = len(to_words(parameter, 0))
        try:
            reply = await self.session.line.read(
                self.session.device, parameter.address, count, priority=Priority.OPERATOR_WRITE
            )
        except DeviceException:
            return None
        return from_words(parameter, reply.words)

    def _text(self, parameter: Parameter, raw: int | None) -> str:
        if raw is None:
            return ""
        profile = self.session.profile
        scale = profile.scale(parameter, self.session.monitor.known.raws())
        return decode(parameter, raw, profile.names(parameter), scale).display

    def _entry(
        self,
        parameter: Parameter,
        old: int | None,
        raw: int,
        answer: str,
        back: int | None,
        why: str,
    ) -> Entry:
        session = self.session
        return Entry(
            time=now_text(),
            line=session.line_text,
            device=session.device,
            profile=session.profile.id,
            code=parameter.code,
            address=parameter.address,
            old_raw=old,
            old=self._text(parameter, old),
            new_raw=raw,
            new=self._text(parameter, raw),
            answer=answer,
            read_back=back,
            why=why,
        )
