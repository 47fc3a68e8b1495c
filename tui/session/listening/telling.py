"""An exchange that was heard, in a sentence."""

from __future__ import annotations

from tui.drive.plain import plain

from .families import Families
from .listener import ToldExchange
from .summary import exception_meaning
from .words import FUNCTION_NAMES, WHO, HeardValue, names_of_words, spans_of

CODES_TOLD_AT_MOST = 4
"""Parameters of a request that are named where it brought no values."""
FUNCTION_WIDTH = 6


def function_name(function: int) -> str:
    """A function as a person calls it."""
    return FUNCTION_NAMES.get(function, f"function {function}")


def names_asked(told: ToldExchange) -> list[str]:
    """The parameters that a request names, each once; addresses where none is known."""
    spans = spans_of(told.exchange.request)
    found = (name for span in spans for name in names_of_words(span, told.profile))
    return list(dict.fromkeys(found))


def exchange_text(told: ToldExchange, families: Families) -> str:
    """Device, function, and the values or what became of it; control characters as signs."""
    one = told.exchange
    head = f"{one.device or 'all':>3} {function_name(one.function):<{FUNCTION_WIDTH}}"
    return plain(f"{head} {_what(told, families)}".rstrip())


def _what(told: ToldExchange, families: Families) -> str:
    one = told.exchange
    match one.answer:
        case "ok" | "broadcast":
            if one.function == WHO:
                return _identity_text(one.device, families)
            return " · ".join(map(_value_text, told.values))
        case "again":
            return "a second answer to the same request: two devices at one address?"
        case "unasked":
            return "an answer to no request that was heard"
    return f"{_asked_text(told)}: {_trouble(told)}".removeprefix(": ")


def _trouble(told: ToldExchange) -> str:
    one = told.exchange
    if one.exception is not None:
        return f"exception {one.exception}, {exception_meaning(one.exception, told.profile)}"
    return "damaged answer" if one.answer == "damaged" else "no answer"


def _value_text(value: HeardValue) -> str:
    return f"{value.code} {'← ' if value.written else ''}{value.value.display}"


def _asked_text(told: ToldExchange) -> str:
    names = names_asked(told)
    more = len(names) - CODES_TOLD_AT_MOST
    return " ".join(names[:CODES_TOLD_AT_MOST]) + (f" and {more} more" if more > 0 else "")


def _identity_text(device: int, families: Families) -> str:
    identity = families.identities.get(device)
    if identity is None:
        return ""
    parts = (identity.vendor, identity.reference, identity.version_text, identity.name)
    return " ".join(part for part in parts if part)
