"""Messages of a running command: lines for a person, a list of sentences in JSON."""

from __future__ import annotations

from .say import say


class Messages:
    """Sentences of one command; with `as_json` standard output is kept free of them."""

    def __init__(self, *, as_json: bool) -> None:
        self.as_json = as_json
        self.texts: list[str] = []

    def tell(self, text: str, *, indent: int = 0) -> None:
        """Report a notice; continuation lines are indented by so many columns."""
        self.texts.append(text)
        if not self.as_json:
            say(text, indent=indent)

    def complain(self, text: str) -> None:
        """Report a problem; on standard error in any case."""
        self.texts.append(text)
        say(f"drivepanel: {text}", err=True)
