"""Slot contents requested by `block`: typed, from a file, or the factory's."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .errors import USAGE, Failure

if TYPE_CHECKING:
    from tui.drive.blocks.assignment import Assignment
    from tui.session.drive import DriveSession


@dataclass(frozen=True, slots=True)
class Wanted:
    """Slots requested by the arguments."""

    action: str
    words: tuple[str, ...]
    dry_run: bool
    as_json: bool


async def plans_of(
    session: DriveSession, wanted: Wanted
) -> tuple[dict[str, int], list[Assignment]]:
    """Return the slots' contents, and the assignments requested for them."""
    from tui.drive.blocks.assignment import MappingError, assignment, factory, place_of
    from tui.drive.blocks.picking import pick
    from tui.session.blocks.mapping import Mapper

    profile = session.profile
    named = [_pair(text) for text in wanted.words] if wanted.action == "set" else []
    _check_once([slot for slot, _ in named])
    # told before anything is asked: a slot that is not there
    places = [(*place_of(profile, slot), code) for slot, code in named]
    loaded = _loaded(session, wanted)
    mapper, held = Mapper(session), dict[str, int]()
    plans: list[Assignment] = []
    for block in profile.data.blocks:
        mine = [(place, code) for item, place, code in places if item is block]
        if wanted.action == "set" and not mine:
            continue
        if wanted.action == "load" and block.id not in loaded:
            continue
        found = await mapper.slots(block)
        plan = assignment(block, found)
        if plan is None:
            raise MappingError(f"Not every slot of {block.name.lower()} could be read.")
        held |= plan.slots
        if wanted.action == "factory":
            plan = factory(profile, block)
        plan = loaded.get(block.id, plan)
        for place, code in mine:
            plan = pick(profile, plan, place, code)
        plans.append(plan)
    return held, plans


def _loaded(session: DriveSession, wanted: Wanted) -> dict[str, Assignment]:
    from tui.drive.blocks.assignment import MappingError
    from tui.drive.blocks.file import load_blocks
    from tui.drive.small_file import read_small_text

    if wanted.action != "load":
        return {}
    file = wanted.words[0]
    try:
        return load_blocks(read_small_text(Path(file)), file, session.profile)
    except OSError as error:
        raise Failure(f"{file} cannot be read: {error.strerror}.", USAGE) from error
    except UnicodeDecodeError as error:
        raise Failure(f"{file}: byte {error.start} is not UTF-8 text.", USAGE) from error
    except MappingError as error:
        raise Failure(str(error), USAGE) from error


def _check_once(slots: list[str]) -> None:
    folded = [slot.casefold() for slot in slots]
    if twice := ", ".join(slot for slot in slots if folded.count(slot.casefold()) > 1):
        raise click.UsageError(f"{twice}: given more than once. Which code is meant?")


def _pair(text: str) -> tuple[str, str]:
    slot, sign, code = text.partition("=")
    if not sign or not slot.strip():
        raise click.UsageError(f"{text!r} is not written SLOT=CODE or SLOT=none.")
    return slot.strip(), code.strip()
