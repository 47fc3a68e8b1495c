"""Identification of a drive by the values of its registers; only reads."""

from __future__ import annotations

import asyncio

from tui.bus.api import Priority
from tui.bus.errors import ChecksumFault, DeviceException, NoAnswer, RequestRefused, WrongReply
from tui.drive.profile.profile import Profile
from tui.drive.profile.register_identity import RegisterIdentity, register_identities, row_fits
from tui.drive.profile.schema import Parameter
from tui.drive.words import characters_of, from_words, word_count

from .identifying import Askable

REGISTER_TRIES = 2
"""Number of requests for one register if replies are lost or damaged."""


class RegisterReads:
    """Reads of one device by function 3, word by word; each word is read once.

    More is not sent to a device whose family is not known.
    """

    def __init__(
        self, line: Askable, device: int, priority: Priority, within: float | None
    ) -> None:
        self._line, self._device = line, device
        self._priority, self._within = priority, within
        self._read: dict[int, int | None] = {}

    async def raw(self, parameter: Parameter) -> int | None:
        """Return the raw value of a parameter; None if the drive does not have it.

        Raises ChecksumFault or WrongReply if no reply was intact.
        """
        words = []
        for place in range(word_count(parameter)):
            if (word := await self.word(parameter.address + place)) is None:
                return None
            words.append(word)
        return from_words(parameter, words)

    async def word(self, address: int) -> int | None:
        """Return a register; None without an answer. Raises ChecksumFault, WrongReply."""
        if address not in self._read:
            self._read[address] = await self._ask(address)
        return self._read[address]

    async def _ask(self, address: int) -> int | None:
        unclear: ChecksumFault | WrongReply | None = None
        for _ in range(REGISTER_TRIES):
            try:
                reply = await self._line.read(
                    self._device, address, 1, priority=self._priority, within=self._within
                )
            except (DeviceException, RequestRefused):
                return None
            except NoAnswer:
                continue
            except (ChecksumFault, WrongReply) as error:
                unclear = error
            else:
                return reply.words[0]
        if unclear is not None:
            raise unclear
        return None


async def families_by_registers(reads: RegisterReads, reference: str) -> tuple[str, ...]:
    """Return the profiles whose identifying registers a drive has, with all of their values.

    A family with prefixes that do not fit the drive's `reference` is not among them. If a drive
    of another family may have these values, and has its status word, that family is added.
    """
    found: list[str] = []
    for family in await asyncio.to_thread(register_identities):
        other = reference and family.prefixes
        if not other and await _fits(reads, family):
            found.append(family.profile)
            for address, ids in family.others.items():
                if await reads.word(address) is not None:
                    found += ids
    return tuple(dict.fromkeys(found))


async def _fits(reads: RegisterReads, family: RegisterIdentity) -> bool:
    for parameter, row in family.rows:
        if not row_fits(parameter, row, await reads.raw(parameter)):
            return False
    return True


async def unexpected_register(reads: RegisterReads, profile: Profile) -> str:
    """Return the identifying register of a profile that has another value; empty if none has.

    Registers that the drive does not have are ignored.
    """
    for row in profile.data.identification.registers:
        parameter = profile[row.parameter]
        raw = await reads.raw(parameter)
        if raw is not None and not row_fits(parameter, row, raw):
            value = characters_of(parameter, raw) if row.begins else raw
            return f"{parameter.code} ({parameter.number}) {value!r}"
    return ""
