"""`drivepanel` and `python -m tui`."""

from __future__ import annotations


def main() -> None:
    """Run the command line."""
    from tui.cli.shared.standard_streams import keep_streams

    keep_streams()
    from tui.cli.main import main as command

    command(prog_name="drivepanel")


if __name__ == "__main__":
    main()
