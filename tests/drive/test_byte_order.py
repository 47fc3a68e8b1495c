"""Which raw values show that the bytes of a drive's words arrive swapped."""

from __future__ import annotations

import pytest

from tests.session.fakes import parameter, profile_of
from tui.drive.byte_order import ENOUGH, only_swapped, swapped_word, telling_codes

LIMITS: dict[str, object] = {"min": 1, "max": 247}
NAMES: dict[str, object] = {"values": {"1": "Off", "2": "On", "772": "Slow"}}
UNKNOWN = 0x8000


def judged(raw: int, **fields: object) -> bool | None:
    """The judgment of a raw value of a parameter with these fields."""
    profile = profile_of(
        parameter("P", 10, **fields), reading={"unknown_word": UNKNOWN}, enumerations=[]
    )
    return only_swapped(profile, profile["P"], raw)


@pytest.mark.parametrize(
    ("raw", "swapped"),
    [
        (0x0001, False),
        (0x00F7, False),
        (0x0100, True),
        (0xF700, True),
        (0xF800, None),  # neither is valid
        (0x0000, None),
        (UNKNOWN, None),
        (0x0080, None),
    ],
)
def test_value_with_stated_limits_shows_the_byte_order(raw: int, swapped: bool | None) -> None:
    assert judged(raw, **LIMITS) is swapped


@pytest.mark.parametrize(
    ("raw", "swapped"), [(2, False), (0x0200, True), (0x0304, False), (0x0403, True), (5, None)]
)
def test_name_shows_the_byte_order(raw: int, swapped: bool | None) -> None:
    assert judged(raw, **NAMES) is swapped


def test_value_that_is_valid_in_both_orders_shows_nothing() -> None:
    assert judged(0x0001, min=0, max=0x1000) is None
    assert judged(0x0101, **LIMITS) is None


@pytest.mark.parametrize(
    "fields",
    [
        {"min": None},
        {"max": None},
        {"type": "uint32"},
        {"mask": 0x00FF},
        {"access": "w"},
        {"confidence": "unverified"},
        {"confidence": "analogy"},
        {"limit_grounds": {"source": "manual", "confidence": "analogy"}},
        {"limit_grounds": {"source": "manual", "confidence": "unverified"}},
        {"bits": [{"bit": 0, "name": "ready"}]},
    ],
    ids=str,
)
@pytest.mark.parametrize("raw", [0x0001, 0x0100])
def test_value_without_limits_of_a_manual_shows_nothing(
    raw: int, fields: dict[str, object]
) -> None:
    """A guess at the limits must not accuse the line."""
    assert judged(raw, **{**LIMITS, **fields}) is None


def test_limits_of_a_public_document_count() -> None:
    grounds = {"source": "manual", "confidence": "manual"}
    assert judged(0x0100, **LIMITS, limit_grounds=grounds) is True


@pytest.mark.parametrize("word", [0, 1, 0xFF, 0x100, 0x1234, 0xFFFF])
def test_swapped_word_has_the_bytes_of_the_word_in_the_other_order(word: int) -> None:
    assert swapped_word(word).to_bytes(2, "big") == word.to_bytes(2, "little")


def test_settings_of_the_line_are_read_first_then_usual_ones_and_few() -> None:
    roles = ("address", "baud", "parity", "timeout")
    own = [parameter(f"L{n}", n, **LIMITS) for n in range(len(roles))]
    usual = [
        parameter("RATED", 22, quantity="rated_frequency", **LIMITS),
        parameter("HIGH", 21, quantity="high_speed", **LIMITS),
    ]
    settings = [{"role": role, "parameter": f"L{n}"} for n, role in enumerate(roles)]
    link = {"baud": 19200, "format": "8E1", "settings": settings}
    codes = telling_codes(profile_of(*usual, *own, link=link))
    assert codes == ("L0", "L1", "L2", "L3", "HIGH")
    assert len(codes) == ENOUGH
    assert telling_codes(profile_of(*usual)) == ("HIGH", "RATED")
