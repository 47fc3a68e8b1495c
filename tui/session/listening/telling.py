"""Description of an observed exchange, in a sentence."""

from __future__ import annotations

from tui.drive.plain import plain
from tui.drive.sentences import capitalized, first_of, sentence

from .families import Families
from .listener import DecodedExchange
from .summary import exception_meaning
from .words import FUNCTION_NAMES, WHO, ObservedValue, names_of_words, spans_of

CODES_NAMED_AT_MOST = 4
"""Number of parameters of a request that are named if it returned no values."""
FUNCTION_WIDTH = 6
ECHO_AT = 3
"""Offset of the value in the echo of a write, from the function byte on."""


def function_name(function: int) -> str:
    """Return the common name of a function."""
    return FUNCTION_NAMES.get(function, f"function {function}")


def requested_names(reported: DecodedExchange) -> list[str]:
    """Return the parameters that a request names, each once; addresses for unknown ones."""
    spans = spans_of(reported.exchange.request)
    found = (name for span in spans for name in names_of_words(span, reported.profile))
    return list(dict.fromkeys(found))


def exchange_text(reported: DecodedExchange, families: Families) -> str:
    """Return device, function, and the values or the result; control characters are replaced."""
    exchange = reported.exchange
    head = f"{exchange.device or 'all':>3} {function_name(exchange.function):<{FUNCTION_WIDTH}}"
    return plain(f"{head} {_what(reported, families)}".rstrip())


def _what(reported: DecodedExchange, families: Families) -> str:
    exchange = reported.exchange
    match exchange.answer:
        case "ok" | "broadcast":
            if exchange.function == WHO:
                return _identity_text(exchange.device, families)
            text = " · ".join(map(_value_text, reported.values))
            if exchange.has_other_echo:
                other = f"answered 16#{exchange.reply[ECHO_AT:].hex().upper()}"
                text = f"{text}, {other}" if text else other
            return text
        case "again":
            return "a second answer to the same request: two devices at one address?"
        case "unasked":
            return "an answer without a request"
    names = first_of(requested_names(reported), CODES_NAMED_AT_MOST, " ")
    return f"{names}: {_trouble(reported)}".removeprefix(": ")


def _trouble(reported: DecodedExchange) -> str:
    exchange = reported.exchange
    if exchange.exception is not None:
        meaning = exception_meaning(exchange.exception, reported.profile)
        return f"exception {exchange.exception}. {sentence(capitalized(meaning))}"
    return "damaged answer" if exchange.answer == "damaged" else "no answer"


def _value_text(value: ObservedValue) -> str:
    arrow = "← " if value.written else ""
    return f"{value.code} {arrow}{value.value.display}"


def _identity_text(device: int, families: Families) -> str:
    identity = families.identities.get(device)
    if identity is None:
        return ""
    parts = (identity.vendor, identity.reference, identity.version_text, identity.name)
    return " ".join(part for part in parts if part)
