"""Stop of a drive by its prepared frames, after an internal error in its usual stop.

As little code as possible is between this module and the line. An error in anything but the
sending of the frame is logged and ignored.
"""

from __future__ import annotations

import logging
from functools import partial

from tui.bus.api import ModbusLine
from tui.bus.errors import LineError, LineFailed, LineLost
from tui.bus.link import label
from tui.drive.errors import DriveError
from tui.drive.sentences import sentence
from tui.drive.values import from_words
from tui.wire.frames import at_place, raw_of_words, written_text

from ..carry_on import carried_on
from ..drive import DriveSession
from ..journal import Entry, Journal, now_text
from ..settings.write import Writer
from .motor_stop import MotorStop, TellStop
from .stop_report import AT_THE_MACHINE, NOT_STOPPED, Phase, not_stopped

log = logging.getLogger(__name__)

PREPARED_SENT = "stop sent by its prepared frames after an internal error; see the log"
SENT_THOUGH_LOST = "stop sent on a connection of its own, as the line was lost"
NOT_FOLLOWED = (
    f"{NOT_STOPPED}an internal error (see the log). Its stop was sent, but not seen to work."
    f" {AT_THE_MACHINE}"
)
NONE_PREPARED = f"{NOT_STOPPED}an internal error (see the log), and no frame was ready. "
NOT_SENT = f"{NOT_STOPPED}an internal error (see the log), and its prepared frame was not sent: "


def end_work(session: DriveSession, by: str) -> None:
    """End the work on a drive and its arming; raise its stop count whatever fails."""
    before = session.work.stops
    carried_on(lambda: session.work.stop(by))
    if session.work.stops == before:
        session.work.stops += 1
    carried_on(lambda: session.starts.withdraw(session) if session.starts is not None else None)


class LastStop:
    """Sends prepared frames and follows the motor; `send` may be called from any thread.

    It also tries on a lost line: a connection of its own may still let one frame through.
    """

    def __init__(self, line: ModbusLine, journal: Journal, say: TellStop) -> None:
        self._line = line
        self._journal = journal
        self._say = say

    def send(
        self, session: DriveSession, ordered: float, error: Exception, *, taken: bool = False
    ) -> None:
        """Stop a drive after an internal error; `taken` if it has acknowledged its stop word.

        Then no other word is sent: the word for every chart would let a motor on its ramp coast.
        """
        lost = isinstance(error, LineLost) and not isinstance(error, LineFailed)
        if taken:
            text = not_stopped(str(error)) if lost else NOT_FOLLOWED
            self._say(session, Phase.FAILED, text, ordered)
        elif not session.prepared:
            text = not_stopped(str(error)) if lost else f"{NONE_PREPARED}{AT_THE_MACHINE}"
            self._say(session, Phase.FAILED, text, ordered)
        else:
            ended = partial(self._ended, session, ordered, str(error) if lost else "")
            try:
                self._line.send_prepared(session.prepared, ended)
            except Exception as failure:
                ended(str(failure) or type(failure).__name__)
        if lost:
            return
        # last, because the log may be what has failed
        carried_on(partial(log.error, "stop of device %s", session.device, exc_info=error))

    def _ended(self, session: DriveSession, ordered: float, lost: str, why: str) -> None:
        """Report that the frames were sent, or `why` not; `lost` is the error of a lost line."""
        if why:
            text = not_stopped(lost) if lost else f"{NOT_SENT}{sentence(why)} {AT_THE_MACHINE}"
            self._say(session, Phase.FAILED, text, ordered)
            return
        text = SENT_THOUGH_LOST if lost else PREPARED_SENT
        self._say(session, Phase.STOPPING, text, ordered)
        carried_on(partial(self._record, session, text))
        try:
            self._line.spawn(partial(self._follow, session, ordered), f"stopped {session.device}")
        except Exception as error:
            self.send(session, ordered, error, taken=True)

    def _record(self, session: DriveSession, why: str) -> None:
        session.reported_by_line = True
        for write in session.prepared:
            request = write.request
            place, values = request.written
            if not values:
                continue
            function, address = at_place(place)
            parameter = session.profile.at(address, function)
            code, word = str(address), raw_of_words(place, values)
            if parameter is not None:
                code, word = parameter.code, from_words(parameter, values)
                session.image.doubt(code)
            text = written_text(place, values)
            self._journal.add(
                Entry(
                    now_text(), label(session.line.link), session.device, session.profile.id, code,
                    address, None, "", word, text, "not known", None, why,
                )
            )  # fmt: skip

    async def _follow(self, session: DriveSession, ordered: float) -> None:
        """Follow the motor to standstill; after any error it counts as not stopped."""
        try:
            writer = Writer(session, self._journal, None)
            why = await MotorStop(session, writer, "stop", ordered, self._say).follow()
        except (LineError, DriveError) as error:
            why = str(error)
        except Exception as error:
            self.send(session, ordered, error, taken=True)
            return
        if why is not None:
            self._say(session, Phase.FAILED, not_stopped(why), ordered)
