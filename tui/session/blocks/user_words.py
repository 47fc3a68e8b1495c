"""Four words of a drive that a person monitors, read singly and kept in the state folder."""

from __future__ import annotations

from pathlib import Path

from tui.bus.api import Priority
from tui.bus.errors import DeviceException
from tui.drive.blocks.assignment import MappingError
from tui.drive.blocks.user_words import COUNT, UserWord, UserWords, format_named, is_no_value

from ..drive import DriveSession
from ..paths import state_folder
from ..stored import store_json, stored_json


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
    """Store them for this drive; return why that failed, or an empty string."""
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
