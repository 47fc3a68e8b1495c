"""The messages by which a program has the owner of a line poll for it; see PollPlan."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from ..bounds import ByteString, MonotonicTime, Number, Word
from ..poll_plan import MOST_READS, MOST_TURNS, PollPlan
from .carried import ErrorForm


class Subscribe(msgspec.Struct, frozen=True, tag=True):
    """A program wants the cycles of a plan, in place of an earlier one of that number."""

    number: Number
    plan: PollPlan


class Unsubscribe(msgspec.Struct, frozen=True, tag=True):
    """A program wants no more cycles of a plan."""

    number: Number


class PolledReply(msgspec.Struct, frozen=True, array_like=True):
    """A reply of a cycle, or the error that came instead."""

    pdu: ByteString
    time: MonotonicTime
    failure: tuple[Word, ErrorForm] | None = None


class Polled(msgspec.Struct, frozen=True, tag=True):
    """A cycle of a plan; replies in the order of its turn, none after the error that ended it."""

    number: Number
    turn: Annotated[int, Meta(ge=0, lt=MOST_TURNS)]
    begun: MonotonicTime
    replies: Annotated[tuple[PolledReply, ...], Meta(max_length=MOST_READS)]
