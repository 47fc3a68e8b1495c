"""Command and status words of a drive, the same quantities for every family. Pure."""

from __future__ import annotations

from .profile.profile import Profile
from .profile.schema import Parameter, Quantity

COMMUNICATION_WORDS: tuple[Quantity, ...] = (
    "command_word", "command_word_2", "extended_command_word",
    "status_word", "status_word_2", "status_word_3", "extended_status_word",
)  # fmt: skip
"""Quantities of the command and status words of all families."""


def communication_words(profile: Profile) -> dict[Quantity, Parameter]:
    """Return the command and status words of a family that can be read."""
    found = ((quantity, profile.quantity(quantity)) for quantity in COMMUNICATION_WORDS)
    return {
        quantity: parameter
        for quantity, parameter in found
        if parameter is not None and parameter.access != "w"
    }
