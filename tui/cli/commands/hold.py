"""`drivepanel hold`: keeps polling drives, so that their communication timeout does not run out."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import click
from msgspec import UNSET

from ..shared.drive_commands import complain
from ..shared.errors import LINE_TROUBLE, Failure, status_of
from ..shared.holding import Holding, keep_polling
from ..shared.options import (
    Target,
    connect_drive,
    force_profile_option,
    json_option,
    line_argument,
    on_line,
    profile_option,
    read_only_option,
    several_devices_option,
)
from ..shared.pending_timeouts import timeout_field
from ..shared.registration import ON_LINE, command
from ..shared.say import say

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.timeout_report import Timeout

    from ..documents.drive_documents import HoldEvent

DISARMS = (
    "While this runs, the communication timeout gives no protection: if the program or master"
    " that commands the drive fails, the motor keeps running. Press Ctrl-C to end."
)


class HeldTeller(Protocol):
    """Reports an event of a drive, at the beginning with the prevented reaction."""

    def __call__(
        self, event: HoldEvent, device: int, text: str, found: Timeout | None = None, /
    ) -> None: ...


@command("Keep polling drives so that they do not time out.", group="Watch", statuses=ON_LINE)
@line_argument
@several_devices_option
@profile_option
@force_profile_option
@read_only_option
@json_option
def hold(
    line_text: str,
    device: tuple[int, ...],
    profile_id: str | None,
    force_profile: bool,
    read_only: bool,
    as_json: bool,
) -> None:
    """Keep polling drives until Ctrl-C, so that their communication timeout does not expire.

    It reads, and writes nothing. A polled drive cannot detect that its controller is lost: its own
    protection is off. At the end it reports how and when each drive will react.
    """
    wanted = list(dict.fromkeys(device))
    targets = [Target(line_text, d, profile_id, force_profile=force_profile) for d in wanted]
    tell = _json_teller(line_text) if as_json else _teller

    async def work(opened: OpenLine) -> None:
        async with keep_polling(opened, tell) as (holding, ending):
            taking = asyncio.create_task(_take_all(opened, targets, holding, tell))
            end = asyncio.create_task(ending.event.wait())
            try:
                # drives that answer are kept polled during the search for others
                await asyncio.wait({taking, end}, return_when=asyncio.FIRST_COMPLETED)
                if taking.done():
                    await taking
                    await holding.until(ending)
            finally:
                taking.cancel()
                end.cancel()

    on_line(targets[0], work, read_only=read_only)


async def _take_all(
    opened: OpenLine, targets: Sequence[Target], holding: Holding, tell: HeldTeller
) -> None:
    """Keep polling each drive as soon as it has answered; raises where none does."""
    from tui.session.monitor.timeout import timeout_now

    failure: Exception | None = None
    for target in targets:
        try:
            session = await _connected(opened, target)
        except Exception as error:
            known = isinstance(error, click.ClickException) or status_of(error) is not None
            if len(targets) == 1 or not known:
                raise
            failure = error
            complain(str(error))
            continue
        if not holding.fleet.found:
            complain(DISARMS)
        holding.take(session)
        found = timeout_now(session)
        tell("holding", target.device, held_text(session, found), found)
    if failure is not None and not holding.fleet.found:
        raise failure


async def _connected(opened: OpenLine, target: Target) -> DriveSession:
    """A drive that answers, with its timeout."""
    session = await connect_drive(opened, target)
    if opened.line.device_state(target.device).heard is None:
        raise Failure(f"Device {target.device} does not answer.", LINE_TROUBLE)
    return session


def held_text(session: DriveSession, found: Timeout) -> str:
    """Return which reaction of the drive is prevented."""
    who = f"Device {session.device}, {session.profile.name}"
    if not found.known:
        return f"{who}: its communication timeout cannot be read; it is polled often."
    if (watch := found.watch) is None:
        return f"{who}: its communication timeout is off or does not exist; it is polled anyway."
    if watch.reaction is None:
        return f"{who}: kept alive within its communication timeout of {watch.timeout:g} s."
    does = watch.reaction.does.removesuffix(".")
    return f"{who}: kept alive within its communication timeout of {watch.timeout:g} s ({does})."


def _teller(_event: HoldEvent, _device: int, text: str, _found: Timeout | None = None) -> None:
    say(f"{time.strftime('%H:%M:%S')}  {text}")


def _json_teller(line_text: str) -> HeldTeller:
    from ..documents.drive_documents import HoldDocument
    from ..shared.output import iso_time, print_json

    def tell(event: HoldEvent, device: int, text: str, found: Timeout | None = None) -> None:
        document = HoldDocument(
            time=iso_time(time.time()),
            line=line_text,
            device=device,
            event=event,
            text=text,
            timeout=UNSET if found is None else timeout_field(found),
        )
        print_json(document, compact=True)

    return tell
