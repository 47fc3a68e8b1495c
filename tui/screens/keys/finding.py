"""Finding actions of all screens by words: what the palette lists, best first."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from .action import Action
from .table import ACTIONS, screen_actions

NAME_WORDS = 3
"""Words of an action's help that count as its name."""
BY_NAME = {
    "stop": ("stop",),
    "stop_all": ("stop", "all"),
    "arm": ("arm",),
    "run_line('forward')": ("run", "forward"),
    "run_line('reverse')": ("run", "reverse"),
    "ask_stop_as('dc-braking')": ("brake",),
    "take_control": ("take",),
    "take_over": ("take", "over"),
    "stop_as('quick-stop')": ("stop", "quick"),
    "ask_stop_as('freewheel')": ("coast",),
    "stop_as('emergency-stop')": ("stop", "emergency"),
}
"""Actions on a motor: listed for one of these words, and selected for all of them only."""
NOT_FOUND = ("command_palette", "stop_by_space", "step_reference(")
"""Not listed: the palette itself, a key with the same effect as another, and steps of a motor."""
MOVES = ("leave", "goto(", "move", "scroll(", "page", "end(", "group(")
"""Beginnings of the ids of actions that only move: found on their own screen only."""

_WORD = re.compile(r"[^\W_]+")


@dataclass(frozen=True, slots=True)
class FoundAction:
    """An action that matches the typed words."""

    action: Action
    screen: str
    """Screen of the action; the present screen for an action of the app."""
    here: bool
    """True if it works on the present screen."""
    score: int
    ready: bool
    """True if it may be selected for Enter: each typed word begins a word of it."""

    @property
    def name(self) -> str:
        """The help of the action without its final full stop."""
        return self.action.help.removesuffix(".")


def find(query: str, screen: str) -> list[FoundAction]:
    """The actions in which every word of the query occurs, best first; `screen` is the present one.

    An empty query lists the actions of this screen, in the order of its registration.
    """
    words = query.split()
    found: dict[tuple[str, str], FoundAction] = {}
    others = (action for action in ACTIONS if screen not in action.screens)
    for action in (*screen_actions(screen), *others):
        here = not action.screens or screen in action.screens
        if _is_skipped(action, words, here=here):
            continue
        marks = [_mark(action, screen, word, here=here) for word in words]
        if all(marks):
            ready = bool(marks) and min(marks) > 1 and _all_named(action, words)
            item = FoundAction(
                action, screen if here else action.screens[0], here, sum(marks), ready
            )
            found.setdefault((action.id, action.help), item)
    return sorted(found.values(), key=lambda item: (-item.score, not item.here))


def _is_skipped(action: Action, words: Sequence[str], *, here: bool) -> bool:
    if action.id.startswith(NOT_FOUND) or (not here and (not words or action.id.startswith(MOVES))):
        return True
    names = BY_NAME.get(action.id, ())
    return bool(names) and not any(word.casefold().startswith(names) for word in words)


def _all_named(action: Action, words: Sequence[str]) -> bool:
    """Return True if all words that an action requires were typed."""
    typed = [word.casefold() for word in words]
    return all(any(word.startswith(n) for word in typed) for n in BY_NAME.get(action.id, ()))


def _mark(action: Action, screen: str, word: str, *, here: bool) -> int:
    """Return how well a word matches an action: 0 not at all, 1 inside a word, more at the
    beginning of one."""
    if here and word in (action.shown, *action.keys.split(",")):
        return 6
    typed = word.casefold()
    message = _words(action.help)
    name = {*message[:NAME_WORDS], *_words(action.label), *_words(action.id)}
    places = () if here else _words(action.screens[0])
    every = {*message, *name, *places}
    if typed in every:
        mark = 4
    elif any(item.startswith(typed) for item in every):
        mark = 2
    else:
        return int(any(typed in item for item in every))
    return mark + any(text.startswith(typed) for text in name)


def _words(text: str) -> list[str]:
    return _WORD.findall(text.casefold())
