"""Gives the functions of a running process the code that a changed source would give them."""

from __future__ import annotations

import gc
from collections import defaultdict
from collections.abc import Iterable, Iterator
from inspect import CO_OPTIMIZED
from itertools import zip_longest
from types import CodeType, FunctionType


class NotSwapped(Exception):
    """A change that only a new process shows, such as one that runs at import."""


def functions_by_file() -> dict[str, list[FunctionType]]:
    """All functions of this process, by the file of their code."""
    found: dict[str, list[FunctionType]] = defaultdict(list)
    gc.unfreeze()
    for thing in gc.get_objects():
        if type(thing) is FunctionType:
            found[thing.__code__.co_filename].append(thing)
    return found


def swap(functions: Iterable[FunctionType], file: str, before: str, after: str) -> int:
    """Swap the code that differs between two sources of a file; return how many functions have it.

    Raises NotSwapped if a change is outside functions, or does not fit the function as it is.
    """
    pairs = dict(_pairs(*(compile(source, file, "exec") for source in (before, after))))
    if not pairs:
        raise NotSwapped("The change is outside functions.")
    swapped = 0
    for function in functions:
        if new := pairs.get(_place(function.__code__)):
            try:
                function.__code__ = new
            except ValueError as error:
                raise NotSwapped(f"The change does not fit {function.__qualname__}.") from error
            swapped += 1
    return swapped


def _place(code: CodeType) -> tuple[str, int, bytes]:
    return code.co_qualname, code.co_firstlineno, code.co_code


def _pairs(before: CodeType, after: CodeType) -> Iterator[tuple[tuple[str, int, bytes], CodeType]]:
    """The places of functions with their new code, where it differs; raises NotSwapped."""
    is_function = bool(before.co_flags & CO_OPTIMIZED)
    if is_function and not _equal(before, after):
        yield _place(before), after
    elif not _equal(before, after, inner=False):
        raise NotSwapped("The change runs at import.")
    else:
        for old, new in zip_longest(_inner(before), _inner(after)):
            if old is None or new is None:
                raise NotSwapped("The change adds or removes a function.")
            yield from _pairs(old, new)


def _inner(code: CodeType) -> list[CodeType]:
    return [constant for constant in code.co_consts if isinstance(constant, CodeType)]


def _equal(before: CodeType, after: CodeType, *, inner: bool = True) -> bool:
    """True if both do the same, wherever their lines are."""
    plain = [
        [repr(constant) for constant in code.co_consts if not isinstance(constant, CodeType)]
        for code in (before, after)
    ]
    same = (before.co_code, before.co_names, before.co_varnames, before.co_freevars, plain[0]) == (
        after.co_code, after.co_names, after.co_varnames, after.co_freevars, plain[1],
    )  # fmt: skip
    if not same or not inner:
        return same
    both = _inner(before), _inner(after)
    return len(both[0]) == len(both[1]) and all(map(_equal, *both))
