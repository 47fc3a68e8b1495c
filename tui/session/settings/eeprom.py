"""Commands that save a drive's settings to its EEPROM, or restore its factory settings."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from tui.bus.errors import DeviceException, NoAnswer, RequestRefused
from tui.drive.profile.profile import is_verified
from tui.drive.profile.schema import MemoryOrder, Parameter
from tui.drive.sentences import counted, first_of
from tui.drive.settings.factory import factory_is_sure, factory_raw, factory_sources, not_factory
from tui.drive.settings.memory_orders import (
    MemoryRefused,
    eeprom_copy,
    factory_order,
    save_order,
    saved_by_address,
)
from tui.drive.settings.writable import AT_REST, is_setting, line_setting
from tui.drive.shown import depends_on
from tui.drive.values import from_words

from ..drive import DriveSession
from ..journal import Journal
from ..read.retrying_reader import RetryingReader
from ..work import Permit
from .wear import WearGate
from .write import Writer, device_refusal

SAVING_LONGEST = 10.0
"""Most seconds that a drive may take to save or restore settings."""
SAVE_POLL_INTERVAL = 0.1
SETTINGS_NAMED = 8
"""Number of settings that a text names at most."""


async def refuse_frequent_save(
    session: DriveSession, gate: WearGate, codes: Collection[str] = ()
) -> None:
    """Raise MemoryRefused if saves are so frequent that `gate` does not let one pass.

    `codes` are the settings to save, for a family with an EEPROM address for each.
    """
    for copy in filter(None, (eeprom_copy(session.profile[code]) for code in codes)):
        if worn := await gate.refusal(session, copy, 0):
            raise MemoryRefused(worn)
    if (order := session.profile.data.memory.save) is not None:
        parameter = session.profile[order.parameter]
        if worn := await gate.refusal(session, parameter, order.raw):
            raise MemoryRefused(worn)


async def save_to_eeprom(
    session: DriveSession, journal: Journal, permit: Permit, gate: WearGate | None = None
) -> str:
    """Copy the settings to the EEPROM, wait until the drive is done, and return the result as text.

    `gate` decides about frequent saves (default: they are refused). Raises MemoryRefused (wrong
    state, too frequent, or the family needs or has no such command), DeviceException with the
    meaning of the drive's refusal, and the line's other errors.
    """
    gate, writer = gate or WearGate(journal.eeprom), Writer(session, journal, permit)
    if (copies := saved_by_address(session.profile, session.unsaved)) is not None:
        return await _save_copies(writer, copies, gate)
    order = save_order(session.profile)
    await refuse_frequent_save(session, gate)
    await _carry_out(writer, order, why="save to EEPROM", confirmed={order.parameter})
    return f"{session.profile.name}: the settings are saved to EEPROM."


async def _save_copies(writer: Writer, copies: Sequence[Parameter], gate: WearGate) -> str:
    """Write the present value of each setting to its EEPROM address, and read it back there."""
    session = writer.session
    if session.line.read_only:
        raise RequestRefused("The line is read-only: nothing is written.")
    codes = [copy.code for copy in copies]
    await refuse_frequent_save(session, gate, codes)
    retrying = RetryingReader(session)
    unproved = []
    for copy in copies:
        # each time: another source may have started the motor in the meantime
        await _need_rest(retrying)
        raw = (await retrying.ask_raws([copy.code])).get(copy.code)
        if raw is None:
            raise MemoryRefused(
                f"{copy.code} was not saved, because it cannot be read:"
                f" {retrying.why_absent(copy.code)}"
            )
        try:
            proved = await writer.write_parameter(copy, raw, why="save to EEPROM")
        except DeviceException as error:
            text = device_refusal(session.profile, copy, error, retrying.headline).rstrip(".")
            raise DeviceException(
                error.device, error.function, error.address, error.code, text
            ) from error
        session.unsaved_settings.note_saved(copy.code, raw)
        unproved += [] if proved else [copy.code]
    head = counted(len(codes), "saved 1 setting", "saved {count} settings")
    proof = f"not verified: {', '.join(unproved)}" if unproved else "all verified"
    return f"{session.profile.name}: {head} to EEPROM ({', '.join(codes)}), {proof}."


async def factory_reset(
    session: DriveSession, journal: Journal, permit: Permit, *, confirmed: Collection[str] = ()
) -> str:
    """Restore the factory settings, read them, and return the result as text.

    Raises MemoryRefused (wrong state, unknown command, or an unverified word that is not among
    `confirmed`), DeviceException with the meaning of the drive's refusal, and the line's other
    errors.
    """
    order = factory_order(session.profile)
    writer = Writer(session, journal, permit)
    retrying = await _carry_out(writer, order, why="factory settings", confirmed=confirmed)
    # every word may hold something else now
    session.image.forget()
    return await _report(session, retrying)


async def _carry_out(
    writer: Writer,
    order: MemoryOrder,
    *,
    why: str,
    confirmed: Collection[str],
) -> RetryingReader:
    session = writer.session
    if session.line.read_only:
        raise RequestRefused("The line is read-only: nothing is written.")
    profile = session.profile
    parameter = profile[order.parameter]
    if not is_verified(parameter) and parameter.code not in confirmed:
        raise MemoryRefused(
            f"{parameter.code} of {profile.name} is unverified: only a manual of a sister family"
            " describes it. Confirm it once to use it."
        )
    retrying = RetryingReader(session)
    await _check(retrying, order)
    word = order.raw
    if order.bit:
        held = (await retrying.ask_raws([order.parameter])).get(order.parameter)
        if held is None:
            raise MemoryRefused(
                f"Nothing was written, because {order.parameter} cannot be read:"
                f" {retrying.why_absent(order.parameter)}"
            )
        word |= held & 0xFFFF & ~order.raw
    raw = from_words(parameter, [word])
    try:
        # the drive resets the command itself, so reading it back proves nothing
        await writer.write_parameter(parameter, raw, why=why, read_back=False)
    except DeviceException as error:
        text = device_refusal(profile, parameter, error, retrying.headline).rstrip(".")
        raise DeviceException(
            error.device, error.function, error.address, error.code, text
        ) from error
    await _until_done(retrying, order)
    return retrying


async def _need_rest(retrying: RetryingReader) -> None:
    """Raise MemoryRefused unless the drive is known to be at rest."""
    if await retrying.ask_state() not in AT_REST:
        raise MemoryRefused(
            f"Nothing was written: the drive is {retrying.headline}. Stop the motor first."
        )


async def _check(retrying: RetryingReader, order: MemoryOrder) -> None:
    """Raise MemoryRefused unless the drive is known to be at rest, and has settings to restore."""
    await _need_rest(retrying)
    status = retrying.session.profile.quantity("extended_status_word")
    if order.at_rest_mask and status is not None:
        word = (await retrying.ask_raws([status.code])).get(status.code)
        if word is None or word & order.at_rest_mask:
            raise MemoryRefused(
                f"Nothing was written: the motor must be without current, and {status.code} does"
                " not report that."
            )
    if order.groups and not (await retrying.ask_raws([order.groups])).get(order.groups):
        raise MemoryRefused(
            f"{order.groups} selects no group of settings, so the drive would restore nothing."
            " Select the groups on its keypad, in the menu of factory settings."
        )


async def _until_done(retrying: RetryingReader, order: MemoryOrder) -> None:
    """Wait until the drive has reset the command, and has finished writing its EEPROM."""
    profile = retrying.session.profile
    status = profile.quantity("extended_status_word")
    reported = [order.done.parameter] if order.done else []
    own = [] if profile[order.parameter].access == "w" else [order.parameter]
    # a word that can only be written shows nothing: then an answer of the drive is enough
    codes = [*own, *([status.code] if status else []), *reported] or profile.data.status_codes
    if not codes:
        return
    end = retrying.session.clock.monotonic() + SAVING_LONGEST
    while retrying.session.clock.monotonic() < end:
        try:
            raws = await retrying.ask_raws(codes)
        except NoAnswer:
            raws = {}  # a drive that is busy with its memory may not answer for a moment
        pending = (bool(own) or order.done is not None) and _is_pending(order, raws)
        known = status is not None and not retrying.why_absent(status.code)
        busy = profile.data.memory.busy_mask
        word = raws.get(status.code, busy) if status is not None and known else 0
        if raws and not pending and not word & busy:
            return
        await retrying.session.clock.sleep(SAVE_POLL_INTERVAL)
    raise MemoryRefused(
        f"The drive has not finished after {SAVING_LONGEST:g} s. Check its display, and read"
        f" {order.parameter} before you write anything."
    )


def _is_pending(order: MemoryOrder, raws: Mapping[str, int]) -> bool:
    """Return True if the drive has not reported yet that it is done."""
    if order.done is not None:
        return raws.get(order.done.parameter) not in order.done.values
    if order.keeps_value:
        return False
    held = raws.get(order.parameter, order.raw)
    return bool(held & order.raw) if order.bit else held == order.raw


async def _report(session: DriveSession, retrying: RetryingReader) -> str:
    """Count the known factory settings that the drive holds now, and name the others."""
    profile = session.profile
    settings = [
        p
        for p in profile.parameters
        if (p.factory is not None or p.factory_of is not None) and not p.set_by_drive
        if is_setting(profile, p) and not line_setting(profile, p.code)
    ]
    sources = [code for p in settings for code in (*factory_sources(p), *depends_on(p))]
    raws = await retrying.ask_many(dict.fromkeys([*(p.code for p in settings), *sources]))
    lacking = retrying.lacking
    known = [
        p for p in settings if p.code in raws and factory_raw(profile, p, raws, lacking) is not None
    ]
    other = [
        p.code if factory_is_sure(p) else f"{p.code} ?"
        for p in known
        if not_factory(profile, p, raws, lacking)
    ]
    parts = [f"{profile.name}: the factory settings are restored in working memory."]
    if other:
        names = first_of(other, SETTINGS_NAMED)
        parts.append(f"{len(other)} of {len(known)} settings have another value: {names}.")
    elif known:
        parts.append(f"Checked {len(known)} settings; all have their factory value.")
    if unknown := len(settings) - len(known):
        parts.append(f"Not checked: {unknown} settings whose value or factory value is not known.")
    return " ".join(parts)
