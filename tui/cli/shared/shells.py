"""Completion in bash for words with colons, as a LINE has them."""

from __future__ import annotations

import os
from typing import ClassVar

from click.shell_completion import (
    BashComplete,
    CompletionItem,
    add_completion_class,
    split_arg_string,
)

BREAKS = " \t\n\"'@><=;|&(:"
"""Word breaks of readline if a shell does not report its own."""
KEPT = "@$"
"""Breaks that readline leaves at the beginning of the word."""

_SOURCE = """\
%(complete_func)s() {
    local IFS=$'\\n' response completion type value
    response=$(env COMP_LINE="$COMP_LINE" COMP_POINT="$COMP_POINT" \
COMP_BREAKS="$COMP_WORDBREAKS" %(complete_var)s=bash_complete "$1")
    for completion in $response; do
        type=${completion%%%%,*}
        value=${completion#*,}
        if [[ $type == file || $type == dir ]]; then
            COMPREPLY=()
            compopt -o default
        else
            COMPREPLY+=("$value")
            [[ $value == *[:=,] ]] && compopt -o nospace
        fi
    done
    return 0
}
complete -o nosort -F %(complete_func)s %(prog_name)s
"""


class BashByLine(BashComplete):
    """Takes the line as it was typed, since bash breaks a LINE at its colons."""

    name: ClassVar[str] = "bash"
    source_template: ClassVar[str] = _SOURCE

    def get_completion_args(self) -> tuple[list[str], str]:
        """The whole words before the cursor, and the one at it."""
        typed, point = os.environ.get("COMP_LINE", ""), os.environ.get("COMP_POINT", "")
        # the point is empty where something else than a shell's own line asks
        typed = typed[: int(point)] if point.isdecimal() else typed
        words = split_arg_string(typed)
        incomplete = words.pop() if words and not typed[-1:].isspace() else ""
        return words[1:], incomplete

    def format_completion(self, item: CompletionItem[str]) -> str:
        """Kind and value; of the value what bash takes for the word: behind the last break."""
        _, incomplete = self.get_completion_args()
        breaks = os.environ.get("COMP_BREAKS") or BREAKS
        places = ((incomplete.rfind(sign), sign not in KEPT) for sign in breaks)
        kept = max((at + behind for at, behind in places if at >= 0), default=0)
        return f"{item.type},{item.value[kept:]}"


def prepare_completion() -> None:
    """Know the shells; called where one asks."""
    add_completion_class(BashByLine)
