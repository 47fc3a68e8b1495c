"""Slave addresses as a person types them."""

from __future__ import annotations

from tui.bus.errors import LinkSyntaxError

FIRST, LAST = 1, 247


def parse_addresses(text: str) -> list[int]:
    """Addresses from `1-10` or `1,2,31`, each once, in order; raises LinkSyntaxError."""
    found: list[int] = []
    for part in text.replace(" ", "").split(","):
        low, dash, high = part.partition("-")
        if not low.isdecimal() or (dash and not high.isdecimal()):
            raise LinkSyntaxError(f"{text!r} is no list of addresses. Write 1-10 or 1,2,31.")
        first, last = int(low), int(high) if dash else int(low)
        if not FIRST <= first <= last <= LAST:
            raise LinkSyntaxError(f"Slave addresses go from {FIRST} to {LAST}; {part!r} does not.")
        found += range(first, last + 1)
    return list(dict.fromkeys(found))
