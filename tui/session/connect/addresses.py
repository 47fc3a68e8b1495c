"""Slave addresses as a person types them."""

from __future__ import annotations

from collections.abc import Iterable

from tui.bus.errors import LinkSyntaxError

FIRST, LAST = 1, 247
LONGEST_SPAN_END = 9
"""Digits of the longest number that is parsed."""


def parse_addresses(text: str) -> list[int]:
    """Addresses from `1-10` or `1,2,31`, each once, in order; raises LinkSyntaxError."""
    found: list[int] = []
    for part in text.replace(" ", "").split(","):
        low, dash, high = part.partition("-")
        if not low.isdecimal() or (dash and not high.isdecimal()):
            raise LinkSyntaxError(f"{text!r} is not a list of addresses. Write 1-10 or 1,2,31.")
        ends = (low, high) if dash else (low, low)
        # a longer one is above the limit, and a pasted one may be too long for int()
        first, last = (int(end) if len(end) <= LONGEST_SPAN_END else LAST + 1 for end in ends)
        if not FIRST <= first <= last <= LAST:
            raise LinkSyntaxError(f"Slave addresses go from {FIRST} to {LAST}; {part!r} does not.")
        found += range(first, last + 1)
    return list(dict.fromkeys(found))


def addresses_text(devices: Iterable[int]) -> str:
    """Addresses as a person types them, neighbors as one span: `1-3,7`."""
    spans: list[list[int]] = []
    for device in sorted(set(devices)):
        if spans and device == spans[-1][1] + 1:
            spans[-1][1] = device
        else:
            spans.append([device, device])
    return ",".join(f"{low}" if low == high else f"{low}-{high}" for low, high in spans)
