"""Limits that the shared line enforces for a device, from its profile."""

from __future__ import annotations

from tui.bus.limits import Limits, Window
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Block


def limits_of(profile: Profile) -> Limits:
    """Return the requests allowed to a drive of this family; the line refuses all others."""
    functions = {function.code: function for function in profile.data.functions}
    read, inputs, write, both = (functions.get(code) for code in (3, 4, 16, 23))
    coils, bits, write_coils = (functions.get(code) for code in (1, 2, 15))
    diagnose, reading = functions.get(8), profile.data.reading
    return Limits(
        functions=frozenset(functions),
        max_read=(read.max_read if read else None) or 1,
        max_write=(write.max_write if write else None) or 1,
        max_read_4=(inputs.max_read if inputs else None) or 1,
        max_read_1=(coils.max_read if coils else None) or 1,
        max_read_2=(bits.max_read if bits else None) or 1,
        max_write_15=(write_coils.max_write if write_coils else None) or 1,
        max_read_23=(both.max_read if both else None) or 0,
        max_write_23=(both.max_write if both else None) or 0,
        answers_all=read is not None and read.past_limit != "silence",
        single_words_only=reading.single_words_only,
        read_windows=_windows(profile.data.blocks, "read"),
        write_windows=_windows(profile.data.blocks, "write"),
        subfunctions=frozenset(diagnose.subfunctions if diagnose else ()),
        broadcast_functions=frozenset(c for c, function in functions.items() if function.broadcast),
        exceptions={
            e.code: f"{e.name}: {e.meaning}" if e.name else e.meaning
            for e in profile.data.exceptions
        },
    )


def _windows(blocks: list[Block], direction: str) -> tuple[Window, ...]:
    return tuple(
        Window(block.address, block.min_words, block.max_words, block.fixed_start)
        for block in blocks
        if block.direction == direction
    )
